// SPDX-License-Identifier: MIT
// What both roles paint with, on one canvas: colours of the chosen look, lines, circles, shapes, texts with a halo.

const COLOURS = ['bad', 'beacon', 'cloud', 'expected', 'faint', 'fair', 'goal', 'good', 'halo', 'here', 'ink', 'left', 'right', 'trail', 'wall'];

export class Painter {
  constructor(canvas) {
    Object.assign(this, { canvas, pen: canvas.getContext('2d') });
    this.recolour();
  }

  recolour() {
    const style = getComputedStyle(document.documentElement);
    this.colour = Object.fromEntries(COLOURS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }

  // An empty canvas of the view's size.
  begin(view) {
    const sharp = window.devicePixelRatio || 1, { canvas, pen } = this, width = Math.round(view.width * sharp), height = Math.round(view.height * sharp);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.clearRect(0, 0, view.width, view.height);
    pen.lineJoin = pen.lineCap = 'round';
  }

  // What was begun, as a line.
  stroke(colour, width, dash = []) {
    const { pen } = this;
    pen.setLineDash(dash);
    [pen.strokeStyle, pen.lineWidth] = [colour, width];
    pen.stroke();
    pen.setLineDash([]);
  }

  // What was begun, in a light tone with an edge.
  tint(colour, width, dash = [], alpha = 0.15) {
    const { pen } = this;
    Object.assign(pen, { fillStyle: colour, globalAlpha: alpha });
    pen.fill();
    pen.globalAlpha = 1;
    this.stroke(colour, width, dash);
  }

  // What was begun, on a halo: its inside, or the halo again, and its edge.
  sign(colour, width, isFilled, halo = 4) {
    this.stroke(this.colour.halo, halo);
    this.pen.fillStyle = isFilled ? colour : this.colour.halo;
    this.pen.fill();
    if (width) this.stroke(colour, width);
  }

  path(points) {
    const { pen } = this;
    pen.beginPath();
    points.forEach(([sx, sy], k) => (k ? pen.lineTo(sx, sy) : pen.moveTo(sx, sy)));
  }

  line(points, colour, width, dash) {
    this.path(points);
    this.stroke(colour, width, dash);
  }

  ring([sx, sy], radius) {
    this.pen.beginPath();
    this.pen.arc(sx, sy, radius, 0, 2 * Math.PI);
  }

  circle(at, radius, colour, width, dash) {
    this.ring(at, radius);
    this.stroke(colour, width, dash);
  }

  text(text, sx, sy, colour, { size = 12, align = 'left', base = 'alphabetic', weight = 600, halo = 3 } = {}) {
    const { pen } = this;
    Object.assign(pen, { font: `${weight} ${size}px system-ui, sans-serif`, textAlign: align, textBaseline: base, strokeStyle: this.colour.halo, lineWidth: halo, fillStyle: colour });
    if (halo) pen.strokeText(text, sx, sy);
    pen.fillText(text, sx, sy);
  }
}
