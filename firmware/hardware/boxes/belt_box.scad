// SPDX-License-Identifier: MIT
// Belt box: processor board, belt IMU and barometer on the Perma-Proto board, at the back of the belt; the compass sits outside, 20 cm away.
// Axes: x to the wearer's right, z to the back. The Perma-Proto board lies on two ledges and is held by double-sided tape.
include <common.scad>
part = "box"; // or "lid"

inner = [proto[0] + 2 * gap + 12, proto[1] + 2 * gap, 26]; // 12: bosses beside the board
ledge = 4;   // mm above the floor: soldered joints

module box() {
    difference() {
        union() {
            shell(inner);
            ears(inner, strap);
            for (x = [boss + gap, inner[0] - boss - gap - 3])
                translate([x, boss + 1, -e]) cube([3, inner[1] - 2 * boss - 2, ledge + e]);
        }
        translate([-wall - 1, inner[1] / 2 - usb[0] / 2, 9]) cube([wall + 2, usb[0], usb[1]]);   // USB
        for (x = [20, 47, 74]) translate([x, -wall - 1, 12]) rotate([-90, 0, 0]) cylinder(d = cable, h = wall + 2); // thigh, calf, rangers
        translate([inner[0] - 20, inner[1] - 1, 12]) rotate([-90, 0, 0]) cylinder(d = cable, h = wall + 2);         // compass
    }
}

// Holes for the barometer; glue foam over them, inside.
module cover() {
    difference() {
        lid(inner);
        for (x = [-6, -2, 2, 6]) translate([inner[0] / 2 + x, inner[1] / 2, -1]) cylinder(d = 1.5, h = wall + 2);
    }
}

if (part == "box") box(); else cover();
