// SPDX-License-Identifier: MIT
// Small pictures that are drawn often: each is painted once and then copied, on whole pixels of the device.

const MOST = 1024;  // pictures that are kept: 200 names, and signs with 72 headings

export class Sprites {
  constructor() { Object.assign(this, { made: new Map(), sharp: 1 }); }

  clear() { this.made.clear(); }

  // Draw the picture `key` with its middle at a place; `paint(pen)` paints it around the origin, within `half` = [width, height] / 2 in CSS pixels.
  draw(pen, key, sx, sy, half, paint) {
    const sharp = window.devicePixelRatio || 1;
    if (sharp !== this.sharp || this.made.size > MOST) this.clear();
    this.sharp = sharp;
    if (!this.made.has(key)) this.made.set(key, this.make(half, paint));
    const picture = this.made.get(key), { width, height } = picture;
    pen.drawImage(picture, Math.round(sx * sharp - width / 2) / sharp, Math.round(sy * sharp - height / 2) / sharp, width / sharp, height / sharp);
  }

  make([half_width, half_height], paint) {
    const { sharp } = this, sheet = new OffscreenCanvas(2 * Math.ceil(half_width * sharp), 2 * Math.ceil(half_height * sharp)), pen = sheet.getContext('2d');
    pen.setTransform(sharp, 0, 0, sharp, sheet.width / 2, sheet.height / 2);
    pen.lineJoin = pen.lineCap = 'round';
    paint(pen);
    return sheet.transferToImageBitmap();
  }
}
