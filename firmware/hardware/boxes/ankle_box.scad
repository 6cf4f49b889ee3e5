// SPDX-License-Identifier: MIT
// Ankle box: the foot's processor board and its ICM-20649, firmly on the instep, under the laces or on a strap through the ears. Axes: x to the
// toe, along both boards; z up. The Micro lies on two ledges and is held by double-sided tape, the breakout board is screwed to four posts.
include <common.scad>
part = "box"; // or "lid"

post = 5;
inner = [micro[0] + 2 * gap + 2 * boss, micro[1] + qt[1] + 3 * gap + 4, 20];
strap_here = 26; // a strap of 25

module box() {
    difference() {
        union() {
            shell(inner);
            // ears fore and aft would touch toe and shin: they are left and right
            translate([inner[0], 0, 0]) rotate([0, 0, 90]) ears([inner[1], inner[0], inner[2]], strap_here);
            translate([(inner[0] - qt[0]) / 2, inner[1] - qt[1] - 2, 0]) qt_posts(post);
            for (y = [gap + 3, gap + micro[1] - 4])
                translate([boss + 2, y, -e]) cube([micro[0] - 4, 2, post + e]);
        }
        translate([-wall - 1, gap + 1 + micro[1] / 2 - usb[0] / 2, post - 1]) cube([wall + boss + 4, usb[0], usb[1]]); // USB, at the heel
    }
}

if (part == "box") box(); else lid(inner);
