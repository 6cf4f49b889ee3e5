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

  get isUrgent() { return this.orders.some(({ urgent }) => urgent); }

  // The first of those that are not understood yet; an answer that is on its way counts. `guidance`: to an exit, which the order to leave speaks.
  show(orders, guidance = null) {
    for (const id of this.understood) if (!orders.some((one) => one.id === id)) this.understood.delete(id);
    this.orders = orders.filter(({ id }) => !this.understood.has(id));
    const [order] = this.orders;
    $('order').hidden = !order;
    if (!order) return;
    const cue = (order.urgent && guidance?.arrow_rad != null && guidance.text) || '', id = `${order.id} ${Boolean(cue)}`;
    const text = tr(order.text), at = this.said.get(id);
    if ($('order-text').textContent !== text) $('order-text').textContent = text;
    $('order').dataset.urgent = String(order.urgent);
    if (at !== undefined && (!order.urgent || Date.now() - at < AGAIN_MS)) return;
    this.said.set(id, Date.now());
    this.speak(cue ? `${order.text} ${cue}.` : order.text);
  }

  understand() {
    const [{ id }] = this.orders;
    this.understood.add(id);
    this.send('understood', { id });
    this.show(this.orders);
  }
}
