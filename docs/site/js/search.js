// The search in the site's pages. js/index.js, which tools/docs makes, holds their sections in `sections`: [{address, page,
// title, text}]. The sections are in a script since a browser lets no page that was opened from a disk read another file.
"use strict";

const MOST = 50;      // sections that are listed
const AROUND = 100;   // characters before the first word found, and twice as many from it on, that are shown

// The words of a query, as a regular expression each; a word is found where a word of the text begins with it.
function patterns(query) {
  const words = query.split(/\s+/).map(word => word.replace(/^[-`"'([{]+|[`"')\]},;:]+$/g, ""));
  return words.filter(word => /[\p{L}\p{N}]/u.test(word)).map(word =>
    new RegExp("(?<![A-Za-z0-9])" + word.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"), "gi"));
}

const count = (text, pattern) => (text.match(pattern) || []).length;

// How well a section fits; 0 where it lacks a word.
function score(section, words) {
  const heading = section.page + " " + section.title;
  let sum = 0;
  for (const word of words) {
    const found = 20 * count(section.title, word) + 5 * count(heading, word) + Math.min(count(section.text, word), 10);
    if (!found) return 0;
    sum += found;
  }
  return sum;
}

// A paragraph of the text round the first word found, with all words marked.
function excerpt(text, words) {
  const paragraph = document.createElement("p");
  const places = words.map(word => text.search(word)).filter(place => place >= 0);
  const begin = places.length ? text.lastIndexOf(" ", Math.max(Math.min(...places) - AROUND, 0)) + 1 : 0;
  const last = text.indexOf(" ", begin + 3 * AROUND);
  const shown = text.slice(begin, last < 0 ? text.length : last);
  const marks = words.flatMap(word => [...shown.matchAll(word)]).sort((a, b) => a.index - b.index);
  let end = 0;
  if (begin > 0) paragraph.append("... ");
  for (const mark of marks) {
    if (mark.index < end) continue;
    const marked = document.createElement("mark");
    marked.textContent = mark[0];
    paragraph.append(shown.slice(end, mark.index), marked);
    end = mark.index + mark[0].length;
  }
  paragraph.append(shown.slice(end), last < 0 ? "" : " ...");
  return paragraph;
}

function show(query) {
  const words = patterns(query);
  const found = words.length ? sections.map(section => [score(section, words), section]).filter(pair => pair[0])
    .sort((a, b) => b[0] - a[0]).map(pair => pair[1]) : [];
  const listed = found.slice(0, MOST);
  document.getElementById("search-count").textContent = !words.length ? "" : !found.length
    ? "No section has all of these words." : found.length > MOST ? `The best ${MOST} of ${found.length} sections.`
      : `${found.length} section${found.length > 1 ? "s" : ""}.`;
  document.getElementById("search-results").replaceChildren(...listed.map(section => {
    const article = document.createElement("article");
    const heading = document.createElement("h3");
    const link = document.createElement("a");
    link.href = section.address;
    link.textContent = section.title === section.page ? section.title : `${section.page}: ${section.title}`;
    heading.append(link);
    article.append(heading, excerpt(section.text, words));
    return article;
  }));
}

const field = document.getElementById("search-words");
field.value = new URLSearchParams(window.location.search).get("q") || "";
field.addEventListener("input", () => show(field.value));
show(field.value);
