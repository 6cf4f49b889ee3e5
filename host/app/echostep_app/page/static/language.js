// SPDX-License-Identifier: MIT
// The reader's language. Every text of the pages is English where it is made, here or in the host; `tr` writes it in the language of the reader, from one
// catalogue a language. Key of an entry is the English text, without a full stop at its end: {n}, a single letter, stands for a number, {name} for a text,
// which is translated too. Where a language has several plurals, an entry is {one, few, ..., other}, by the first number. A text that no entry has as a
// whole is taken apart at its separators. What has no entry stays as it is: names of rooms and people.

import { recall, remember } from './storage.js';

export const LANGUAGES = { en: 'English', de: 'Deutsch' };
const PARTS = document.documentElement.dataset.parts?.split(' ') ?? ['pages', 'host'];  // what a page says itself, and what the host sends it; a later entry replaces an earlier one
const SEPARATORS = [' · ', '; ', ': ', ', '], SENTENCE = /([.?!…]) /g, END = '\n';
const NUMBER = '(-?\\d+(?:\\.\\d+)?)', TEXT = '((?:(?!, |; |: | · |[.?!…] ).)+?)', ANY = '(.+?)';
const LOOSE = 8;  // letters of an entry at least, whose names may have separators in them: "Take the stairs B, north up"
const MOST_KNOWN = 2000;  // texts whose translation is kept

export const language = chosen();
export const missing = new Set();  // parts that look like words and have no entry; read by tests
const entries = language === 'en' ? {} : await catalogue(language);
const templates = Object.keys(entries).filter((key) => key.includes('{')).sort((a, b) => b.length - a.length).map(template);
const decimal = (1.5).toLocaleString(language)[1], plurals = new Intl.PluralRules(language), known = new Map();
document.documentElement.lang = language;

// The language chosen on this page, by --lang, or in the browser; else English.
function chosen() {
  const liked = [recall('language'), document.documentElement.dataset.lang, ...navigator.languages.map((tag) => tag.split('-')[0])];
  return liked.find((name) => name in LANGUAGES) ?? 'en';
}

async function catalogue(name) {
  const answers = await Promise.all(PARTS.map((part) => fetch(new URL(`${name}-${part}.json`, import.meta.url)).catch(() => null)));
  const parts = await Promise.all(answers.map((answer) => (answer?.ok ? answer.json() : {})));
  return Object.assign({}, ...parts.flatMap(Object.values));  // an entry stands under what shows it first
}

// The pattern of a key, the same for names with separators in them, and the names of its holes.
function template(key) {
  const holes = [], pattern = (text) => new RegExp(`^${key.replace(/[.*+?^$()|[\]\\]/g, '\\$&').replace(/\{(\w+)\}/g, (_, name) => (name.length === 1 ? NUMBER : text))}$`, 'u');
  key.replace(/\{(\w+)\}/g, (_, name) => holes.push(name));
  const isLong = key.replace(/\{\w+\}/g, '').match(/\p{L}/gu)?.length >= LOOSE;
  return { key, holes, first: firstWord(key), pattern: pattern(TEXT), loose: isLong ? pattern(ANY) : null };
}

function firstWord(text) { return text.match(/^\p{L}+(?=[ ,:]|$)/u)?.[0] ?? ''; }

export function tr(text) {
  if (language === 'en') return text;
  if (known.size > MOST_KNOWN) known.clear();
  if (!known.has(text)) {
    const lost = [];
    known.set(text, translated(text, lost));
    for (const part of lost) missing.add(part);
  }
  return known.get(text);
}

// `lost` gets the words that have no entry; in a hole of an entry these are names.
function translated(text, lost) {
  if (!text) return text;
  const own = [], done = whole(text) ?? capital(text) ?? inParts(text, own), loose = own.length ? whole(text, 'loose') : undefined;
  if (loose === undefined) lost.push(...own);
  return loose ?? done;
}

function inParts(text, lost) {
  const sentences = text.replace(SENTENCE, `$1${END}`).split(END);
  if (sentences.length > 1) return sentences.map((part) => translated(part, lost)).join(' ');
  const separator = SEPARATORS.find((one) => text.includes(one));
  if (separator) return text.split(separator).map((part) => translated(part, lost)).join(separator);
  const [, head, end] = text.match(/^(.*?)([.?!…]?)$/su);
  if (head && end) return translated(head, lost) + end;
  if (/\p{Ll}{2}/u.test(text)) lost.push(text);
  return text;
}

// By the entry of a whole text, with or without the full stop at its end.
function whole(text, by = 'pattern') {
  if (Object.hasOwn(entries, text)) return entries[text];
  const first = firstWord(text);
  for (const { key, holes, first: own, [by]: pattern } of templates) {
    const found = (!own || own === first) && pattern && text.match(pattern);
    if (found) return inPlural(entries[key], found).replace(/\{(\w+)\}/g, (_, name) => filled(name, found[1 + holes.indexOf(name)], by));
  }
  return text.endsWith('.') && text.length > 1 ? withStop(whole(text.slice(0, -1), by)) : undefined;
}

const inPlural = (entry, [, ...found]) => (typeof entry === 'string' ? entry : entry[plurals.select(found.map(Number).find(Number.isFinite))] ?? entry.other);

// Seconds as minutes and seconds.
export const minutes = (s) => `${Math.floor(Math.max(s, 0) / 60)}:${String(Math.floor(Math.max(s, 0) % 60)).padStart(2, '0')}`;

const withStop = (text) => text && `${text}.`;
const filled = (name, value, by) => (name.length === 1 ? value.replace('.', decimal) : by === 'loose' ? whole(value) ?? value : translated(value, []));

// By the entry of a text that begins with a small letter elsewhere.
function capital(text) {
  const small = text[0].toLowerCase() + text.slice(1), done = small === text ? undefined : whole(small);
  return done && done[0].toUpperCase() + done.slice(1);
}

// The texts, names and titles of what a page has in its HTML.
export function localise(root) {
  if (language === 'en') return;
  const texts = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const { data } = texts.currentNode, text = data.replace(/\s+/g, ' ').trim();
    if (text) texts.currentNode.data = data.match(/^\s*/)[0] + tr(text) + data.match(/\s*$/)[0];
  }
  for (const name of ['aria-label', 'title', 'placeholder', 'data-empty']) {
    for (const element of root.querySelectorAll(`[${name}]`)) element.setAttribute(name, tr(element.getAttribute(name)));
  }
}

// The list from which a reader chooses; the page is then loaded again.
export function startLanguage(select) {
  select.replaceChildren(...Object.entries(LANGUAGES).map(([name, text]) => new Option(text, name)));
  select.value = language;
  select.onchange = () => {
    remember('language', select.value);
    location.reload();
  };
}
