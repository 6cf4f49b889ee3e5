// SPDX-License-Identifier: MIT
// Clip of the thigh's or the calf's IMU (LSM6DSOX on its breakout board) on an elastic strap, on the outer side of the leg; the board's z axis
// looks out of the open side, to the wearer's side. The board is screwed to four posts (M2.5 x 5), its pins upwards.
include <common.scad>
part = "box"; // or "lid"

post = 4;
inner = [qt[0] + 2 * gap + 2 * boss, qt[1] + 2 * gap + 8, post + 12];

module box() {
    difference() {
        union() {
            shell(inner);
            ears(inner, strap);
            translate([(inner[0] - qt[0]) / 2, (inner[1] - qt[1]) / 2, 0]) qt_posts(post);
        }
        translate([inner[0] / 2, inner[1] - 1, post + 6]) rotate([-90, 0, 0]) cylinder(d = cable, h = wall + 2);
        // two holes for a cable tie, which takes the cable's pull
        for (x = [-6, 6]) translate([inner[0] / 2 + x, inner[1] - 1, post + 6]) rotate([-90, 0, 0]) cylinder(d = 2.5, h = wall + 2);
    }
}

if (part == "box") box(); else lid(inner);
