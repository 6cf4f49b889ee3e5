// SPDX-License-Identifier: MIT
// Dimensions of the boards, and what all boxes share. All lengths in mm; z is up, out of the open side. Not printed yet.

// STEMMA QT breakout board, with headers: outline, holes [Adafruit's board drawing of the LIS3MDL; the others: from memory, measure them].
qt = [25.4, 17.78];
qt_holes = [20.32, 12.7];
qt_hole = 2.5;
// Arduino Micro, without its pins [Arduino's tech-specs.yml: 48 x 18].
micro = [48, 18];
// Half-size Perma-Proto board [from memory: 81 x 51, measure it].
proto = [81, 51];
// HC-SR04 and RCWL-1601 [SparkFun's data sheet: 45 x 20 x 15]; transducers [from memory: 16 wide, 26 apart, 12 high, measure them].
sr04 = [45, 20];
sr04_transducer = 16;
sr04_pitch = 26;
// SRF02 [DFRobot's wiki: 24 x 20 x 17], its transducer as above.

wall = 2;
gap = 0.5;          // of a printed part around a board
boss = 6;           // of an M2.5 screw, which cuts its own thread
thread = 2.1;
clearance = 2.8;    // hole that an M2.5 screw passes
strap = 41;         // an elastic strap of 40
slot = 4;
usb = [12, 8];      // the moulded plug of a Micro-B cable
cable = 6.5;
e = 0.05;           // bodies overlap by this, so that no faces coincide
$fn = 32;

module rounded(size, r) {
    linear_extrude(size[2]) translate([r, r]) offset(r) square([size[0] - 2 * r, size[1] - 2 * r]);
}

// Places of the four lid screws of a box with this inner size.
module at_corners(inner) {
    for (x = [boss / 2, inner[0] - boss / 2], y = [boss / 2, inner[1] - boss / 2]) translate([x, y, 0]) children();
}

// An open box around an inner space whose corner is the origin, with bosses for the lid's screws.
module shell(inner) {
    difference() {
        translate([-wall, -wall, -wall]) rounded([inner[0] + 2 * wall, inner[1] + 2 * wall, inner[2] + wall], 3);
        difference() {
            rounded([inner[0], inner[1], inner[2] + 1], 1);
            at_corners(inner) translate([-boss / 2 - e, -boss / 2 - e, -e]) cube([boss + 2 * e, boss + 2 * e, inner[2] + 2]);
        }
        at_corners(inner) translate([0, 0, inner[2] - 10]) cylinder(d = thread, h = 11);
    }
}

// The lid of such a box, upside down as it is printed; its rim keeps it in place.
module lid(inner) {
    difference() {
        union() {
            translate([-wall, -wall, 0]) rounded([inner[0] + 2 * wall, inner[1] + 2 * wall, wall], 3);
            difference() {
                translate([gap, gap, wall - e]) rounded([inner[0] - 2 * gap, inner[1] - 2 * gap, 1.5], 1);
                translate([gap + 1.5, gap + 1.5, wall - 2 * e]) cube([inner[0] - 2 * gap - 3, inner[1] - 2 * gap - 3, 3]);
                at_corners(inner) translate([-boss / 2 - gap, -boss / 2 - gap, wall - 2 * e]) cube([boss + 2 * gap, boss + 2 * gap, 3]);
            }
        }
        at_corners(inner) translate([0, 0, -e]) cylinder(d = clearance, h = 5);
    }
}

// Two ears with slots for a strap, left and right of a box with this inner size, at its floor.
module ears(inner, width) {
    for (side = [0, 1])
        translate([side ? inner[0] + wall - e : -wall - slot - 5 + e, (inner[1] - width) / 2 - 3, -wall])
            difference() {
                rounded([slot + 5, width + 6, 4], 1.5);
                translate([side ? 2 : 3, 3, -1]) cube([slot, width, 6]);
            }
}

// Four posts under a STEMMA QT board whose corner is the origin.
module qt_posts(height) {
    for (x = [-1, 1], y = [-1, 1])
        translate([qt[0] / 2 + x * qt_holes[0] / 2, qt[1] / 2 + y * qt_holes[1] / 2, -e])
            difference() {
                cylinder(d = 5, h = height + e);
                translate([0, 0, e + 1]) cylinder(d = thread, h = height);
            }
}
