// SPDX-License-Identifier: MIT
// Belt box: the Perma-Proto board with processor board and barometer, at the back of the belt. Axes, worn: x along the belt, y up, z to the
// back. The carrier lies on two ledges. Belt IMU and compass lie above it on the wall that is up, so that their z axes are vertical, the compass
// far from the USB plug. Boards are held by double-sided tape.
include <common.scad>
part = "box"; // or "lid"

shelf = 10; // room for IMU and compass above the carrier
inner = [proto[0] + 2 * gap + 2 * boss, proto[1] + 2 * gap + shelf, qt[0] + 3]; // bosses beside the board
ledge = 4;   // mm above the floor: soldered joints

module box() {
    difference() {
        union() {
            shell(inner);
            ears(inner, strap);
            for (x = [boss + gap, inner[0] - boss - gap - 3])
                translate([x, boss + 1, -e]) cube([3, proto[1] - boss - 2, ledge + e]);
        }
        translate([-wall - 1, proto[1] / 2 - usb[0] / 2, 9]) cube([wall + 2, usb[0], usb[1]]);   // USB
        for (x = [20, 47, 74]) translate([x, -wall - 1, 12]) rotate([-90, 0, 0]) cylinder(d = cable, h = wall + 2); // thigh, calf, rangers
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
