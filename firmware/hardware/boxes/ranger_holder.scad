// SPDX-License-Identifier: MIT
// Holder of a pulse ranger (HC-SR04, RCWL-1601) on the belt, on the hip: the transducers look out of its floor, away from the wearer; the belt
// passes the ears. Axes: x along the belt, -z away from the wearer. With an SRF02: one transducer in the hole at the left.
include <common.scad>
part = "box"; // or "lid"

inner = [sr04[0] + 2 * gap + 2 * boss, sr04[1] + 2 * gap + 6, 18];
rim = 8; // height of the transducers above their board, less the wall

module box() {
    difference() {
        union() {
            shell(inner);
            translate([0, 0, inner[2] + wall - 4]) ears(inner, strap);
            // the board lies on four pads beside its transducers
            for (x = [boss + gap + 1, inner[0] - boss - gap - 4], y = [1, inner[1] - 5])
                translate([x, y, -e]) cube([3, 4, rim + e]);
        }
        for (side = [-1, 1])
            translate([inner[0] / 2 + side * sr04_pitch / 2, inner[1] / 2, -wall - 1]) cylinder(d = sr04_transducer + 1, h = wall + 2, $fn = 64);
        translate([inner[0] / 2, -wall - 1, 13]) rotate([-90, 0, 0]) cylinder(d = cable, h = wall + 2);
    }
}

if (part == "box") box(); else lid(inner);
