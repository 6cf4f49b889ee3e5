// SPDX-License-Identifier: MIT
// What a commander orders: everybody out, a note in words. Each is spoken, everybody out again and again, until the wearer says that it is understood.

import { tr } from '../language.js';

const AGAIN_MS = 10000;  // assumed
const $ = (id) => document.getElementById(id);

export class Orders {
  // `send(kind, fields)`: a request to the server; `speak(text)`: with a tone
  constructor(send, speak) {
    Object.assign(this, { send, speak, orders: [], said: new Map(), understood: new Set() });
    $('understood').onclick = () => this.understand();
  }

  // The first of those that are not understood yet; an answer that is on its way counts.
  show(orders) {
    for (const id of this.understood) if (!orders.some((one) => one.id === id)) this.understood.delete(id);
    this.orders = orders.filter(({ id }) => !this.understood.has(id));
    const [order] = this.orders;
    $('order').hidden = !order;
    if (!order) return;
    const text = tr(order.text), at = this.said.get(order.id);
    if ($('order-text').textContent !== text) $('order-text').textContent = text;
    $('order').dataset.urgent = String(order.urgent);
    if (at !== undefined && (!order.urgent || Date.now() - at < AGAIN_MS)) return;
    this.said.set(order.id, Date.now());
    this.speak(order.text);
  }

  understand() {
    const [{ id }] = this.orders;
    this.understood.add(id);
    this.send('understood', { id });
    this.show(this.orders);
  }
}
