/* Search: entries of the index first, then headings that contain what is looked for, then words of
   pages; the reference of the code after pages that explain. */
var Scorer = {
  score: (result) => result[4] + (result[6] === "title" ? 30 : 0)
    - (/^generated\/|^scene_/.test(result[0]) ? 25 : 0),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
