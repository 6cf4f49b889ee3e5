// SPDX-License-Identifier: MIT
// What the page has said: each text that came up over the map, with the time of day; of one that only counts on, the newest wording.

const MOST = 100;

export class Heard {
  // `box`: the element whose paragraphs come and go; `list`: where the texts are listed, the newest first.
  constructor(box, list) {
    Object.assign(this, { list, kind: '' });
    new MutationObserver((changes) => { for (const { target } of changes) this.note(target); }).observe(box, { subtree: true, childList: true, characterData: true, attributeFilter: ['hidden'] });
  }

  note(target) {
    const text = (target.nodeType === Node.TEXT_NODE ? target.parentElement : target).closest('p');
    if (!text || text.closest('[hidden]') || text.closest('#drop > p:first-child')) return;
    const said = text.innerText.trim(), kind = said.replace(/[\d.]+/g, '#');
    if (!said || (kind === this.kind && this.list.firstChild?.lastChild.textContent === said)) return;
    const item = kind === this.kind ? this.list.firstChild : document.createElement('li');
    this.kind = kind;
    item.replaceChildren(`${new Date().toLocaleTimeString('en-GB')} `, said);
    this.list.prepend(item);
    while (this.list.children.length > MOST) this.list.lastChild.remove();
  }
}
