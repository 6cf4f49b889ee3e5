// SPDX-License-Identifier: MIT
// Order of the search's results: what explains before why it was decided so and what was tried. The other numbers are Sphinx' own.
var Scorer = {
  score: ([page, , , , score]) => (/\/(decisions|notebook)\//.test(page) ? score - 20 : score),
  objNameMatch: 11, objPartialMatch: 6, objPrio: { 0: 15, 1: 5, 2: -5 }, objPrioDefault: 0, title: 15, partialTitle: 7, term: 5, partialTerm: 2,
};
