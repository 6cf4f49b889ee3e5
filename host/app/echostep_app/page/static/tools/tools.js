// SPDX-License-Identifier: MIT
// The dialog "More": colours, layers, charts, measuring, link, GeoJSON; what happened on the walk, and what the page has said.

import { recall, remember } from '../storage.js';
import { geojson, save } from './export.js';
import { linkOf } from './hash.js';
import { Heard } from './heard.js';
import { LAYERS } from './layers.js';
import { dialogOf } from '../dialog.js';
import { minutes, tr } from '../language.js';

const $ = (id) => document.getElementById(id);
const BUTTONS = { measure: 'Measure', charts: 'Charts', link: 'Copy a link', geojson: 'GeoJSON', files: 'Open files…' };
const HTML = `<div tabindex="0" role="group" aria-label="Tools">
  <p class="row">${Object.entries(BUTTONS).map(([name, text]) => `<button id="tool-${name}" type="button">${text}</button>`).join('')}
    <label for="theme" class="unseen">Colours</label><select id="theme"><option value="auto">auto</option><option value="bright">bright</option><option value="dark">dark</option><option value="contrast">high contrast</option></select></p>
  <h3 id="layers-title">Layers</h3>
  <ul aria-labelledby="layers-title">${Object.entries(LAYERS).map(([name, text]) => `<li><label><input type="checkbox" id="layer-${name}"> ${text}</label></li>`).join('')}</ul>
  <h3>What happened</h3><ol id="events" tabindex="0" data-empty="nothing yet"></ol>
  <h3>What this page said</h3><ol id="heard" tabindex="0" data-empty="nothing yet"></ol>
</div>`;

export class Tools {
  // `page`: view, scene, planView, layers, charts, plan(), globe(), hint(text, ms), enter(mode), changed(), seek(t_s)
  constructor(page) {
    Object.assign(this, { page, dialog: dialogOf('tools', 'More', HTML) });
    new Heard($('messages'), $('heard'));
    this.wire();
    this.wireLayers();
    this.setCharts(recall('charts') === 'on');
    Object.assign(page.charts, { onEvents: (events) => this.events(events), isWanted: () => this.dialog.open });
  }

  wire() {
    const { page, dialog } = this, does = { measure: () => page.enter('measure'), charts: () => this.setCharts(!page.charts.on), link: () => this.link(), geojson: () => this.geojson(), files: () => $('drop-file').click() };
    for (const [name, act] of Object.entries(does)) $(`tool-${name}`).onclick = () => { dialog.close(); act(); };
    $('tools-button').onclick = () => this.open();
  }

  wireLayers() {
    const { layers, changed } = this.page;
    for (const name of Object.keys(LAYERS)) {
      $(`layer-${name}`).checked = layers.shows(name);
      $(`layer-${name}`).onchange = ({ target }) => { layers.set(name, target.checked); changed(); };
    }
  }

  open() {
    $('tool-files').hidden = !this.page.takesFiles();
    this.dialog.showModal();
    this.page.charts.read();
  }

  setCharts(on) {
    const { charts } = this.page;
    charts.on = on;
    $('over-time').hidden = !on;
    $('tool-charts').setAttribute('aria-pressed', String(on));
    remember('charts', on ? 'on' : 'off');
    charts.read();
    charts.paint();
  }

  link() {
    const { view, scene, hint } = this.page, link = linkOf(view, scene.level, scene.frame?.play?.t_s ?? null);
    history.replaceState(null, '', link);
    const byHand = () => hint('The link is in the address bar.', 8000);
    if (!navigator.clipboard) return byHand();  // browsers give it to this computer and to https only
    navigator.clipboard.writeText(link).then(() => hint('The link to this view is copied.', 6000), byHand);
  }

  geojson() {
    const { scene, planView, plan, globe, hint } = this.page, { rooms } = plan().levels[scene.level];
    const made = geojson({ lines: planView.lines, level: scene.level, rooms, trail: scene.trail, estimate: scene.frame?.told, globe: globe() });
    save(new Blob([JSON.stringify(made)], { type: 'application/geo+json' }), 'echostep.geojson');
    if (made.coordinates) hint('This plan has no georeference: the file is in metres of the plan.', 8000);
  }

  // What happened, as a list and as ticks on the time bar; in a replay each leads to its moment.
  events(events) {
    const { play } = this.page.scene.frame ?? {}, begin = play?.begin_s ?? this.page.charts.rows[0]?.[0] ?? events[0]?.t_s ?? 0, whole = play ? Math.max(play.end_s - begin, 1e-3) : 1;
    $('events').replaceChildren(...events.map(({ t_s, text }) => {
      const item = document.createElement('li'), at = `${minutes(t_s - begin)} ${tr(text)}`;
      if (!play) item.textContent = at;
      else {
        const button = document.createElement('button');
        Object.assign(button, { type: 'button', textContent: at, onclick: () => { this.dialog.close(); this.page.seek(t_s); } });
        item.append(button);
      }
      return item;
    }));
    $('ticks').replaceChildren(...(play ? events : []).map(({ t_s, text }) => {
      const tick = document.createElement('span');
      tick.title = tr(text);
      tick.style.left = `${100 * (t_s - begin) / whole}%`;
      return tick;
    }));
  }
}
