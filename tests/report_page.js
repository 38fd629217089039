// What tests/report_page.py asks of a report's page. Each function returns plain values.
'use strict';

// ---- What is drawn, and how it is called ---------------------------------------------------------

function data() {
  return JSON.parse(document.getElementById('data').textContent);
}

// Of each figure: how many lines and fills, what its words and lines stick out of the drawing by.
function figures() {
  return [...document.querySelectorAll('svg[data-figure]')].map((svg) => {
    const frame = svg.getBoundingClientRect();
    const parts = [...svg.querySelectorAll('path, polygon, use, text')]
      .filter((part) => part.getBoundingClientRect().width > 0);
    const beyond = parts.map((part) => {
      const box = part.getBoundingClientRect();
      return Math.max(frame.left - box.left, box.right - frame.right, frame.top - box.top, box.bottom - frame.bottom);
    });
    const farthest = beyond.indexOf(Math.max(...beyond));
    return {
      name: svg.dataset.figure, role: svg.getAttribute('role'), label: svg.getAttribute('aria-label'),
      paths: [...svg.querySelectorAll('path')].filter((path) => path.getTotalLength() > 0).length,
      beyond: beyond[farthest], part: parts[farthest].outerHTML.slice(0, 200),
    };
  });
}

// The texts under the sliders.
function readouts() {
  return [...document.querySelectorAll('.controls output')].map((output) => output.innerText);
}

// Pairs of words of one figure that stand on each other.
function overlaps() {
  const found = [];
  for (const svg of document.querySelectorAll('svg[data-figure]')) {
    const words = [...svg.querySelectorAll('text')].filter((t) => t.textContent.trim());
    const boxes = words.map((t) => t.getBoundingClientRect());
    for (let i = 0; i < words.length; i++)
      for (let j = 0; j < i; j++) {
        const a = boxes[i], b = boxes[j];
        const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        if (wide > 1 && high > 0.4 * Math.min(a.height, b.height))
          found.push(`${svg.dataset.figure}: "${words[j].textContent}" and "${words[i].textContent}"`);
      }
  }
  return found;
}

// Words in a figure that a curve of the palette's six colours passes through.
function covered() {
  const found = [], curves = palette().colours.slice(1, 7).map((c) => c.join());
  for (const svg of document.querySelectorAll('svg[data-figure]')) {
    const points = [...svg.querySelectorAll('path')]
      .filter((path) => curves.includes(rgba(getComputedStyle(path).stroke).slice(0, 3).join()))
      .flatMap((path) => {
        const matrix = path.getScreenCTM(), length = path.getTotalLength();
        return Array.from({ length: Math.ceil(length / 2) + 1 }, (_, k) => path.getPointAtLength(2 * k).matrixTransform(matrix));
      });
    for (const words of svg.querySelectorAll('text')) {
      const box = words.getBoundingClientRect(), edge = 0.2 * box.height;
      if (points.some((p) => p.x > box.left && p.x < box.right && p.y > box.top + edge && p.y < box.bottom - edge))
        found.push(`${svg.dataset.figure}: "${words.textContent.trim()}"`);
    }
  }
  return found;
}

// Tables that are wider than what shows them.
function cut() {
  return [...document.querySelectorAll('.table')]
    .filter((t) => t.scrollWidth > t.clientWidth || t.getBoundingClientRect().right > document.documentElement.clientWidth)
    .map((t) => t.dataset.table);
}

// Of each figure: how many of its words stand upright, which are the labels of vertical axes.
function uprights() {
  return Object.fromEntries([...document.querySelectorAll('svg[data-figure]')].map((svg) =>
    [svg.dataset.figure, [...svg.querySelectorAll('text')].filter((t) => t.getCTM().b !== 0 && t.textContent.trim()).length]));
}

function structure() {
  const ids = [...document.querySelectorAll('[id]')].map((e) => e.id);
  return {
    repeated: ids.filter((id, i) => ids.indexOf(id) !== i),
    headings: [...document.querySelectorAll('h1, h2, h3, h4, h5, h6')].map((h) => [Number(h.tagName[1]), h.textContent]),
    unnamed: [...document.querySelectorAll('table')]
      .filter((t) => !t.caption && !t.getAttribute('aria-label') && !t.closest('[aria-label]')).length,
    links: [...document.querySelectorAll('a[href^="#"]')]
      .filter((a) => !document.getElementById(a.getAttribute('href').slice(1))).map((a) => a.href),
    wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    scripts: document.scripts.length, images: document.images.length,
  };
}

// ---- Markers -------------------------------------------------------------------------------------

const shown = (element) => element.getAttribute('visibility') === 'visible';

// Of each panel: its vertical and level cursor, then the marker of each curve; null where hidden.
function markers(name, curves) {
  const svg = document.querySelector(`svg[data-figure="${name}"]`);
  const cursors = [...svg.querySelectorAll('line.cursor')], circles = [...svg.querySelectorAll('circle.marker')];
  const number = (element, key) => Number(element.getAttribute(key));
  return curves.map((count) => ({
    cursors: cursors.splice(0, 2).map((c, k) => shown(c) ? number(c, k === 0 ? 'x1' : 'y1') : null),
    circles: circles.splice(0, count).map((c) => shown(c)
      ? { at: [number(c, 'cx'), number(c, 'cy')], colour: getComputedStyle(c).fill } : null),
  }));
}

// The lines of a figure by colour, as lists of points.
function lines(name) {
  const found = {};
  for (const path of document.querySelector(`svg[data-figure="${name}"]`).querySelectorAll('path')) {
    const points = [...path.getAttribute('d').matchAll(/([ML])\s*(-?[\d.]+),(-?[\d.]+)/g)]
      .map(([, what, x, y]) => [what, Number(x), Number(y)]);
    (found[getComputedStyle(path).stroke] ||= []).push(...points);
  }
  return found;
}

function output(attribute, name) {
  const words = document.querySelector(`.controls[data-${attribute}="${name}"] output`);
  return words.children.length ? [...words.children].map((row) => row.textContent) : [words.textContent];
}

// Client coordinates of a place in a figure, brought to the middle of the window.
function place(name, x, y) {
  const svg = document.querySelector(`svg[data-figure="${name}"]`);
  const at = () => new DOMPoint(x, y).matrixTransform(svg.getScreenCTM());
  window.scrollBy({ top: at().y - window.innerHeight * 0.6, behavior: 'instant' });
  return [at().x, at().y];
}

function tip(name) {
  const words = document.querySelector(`svg[data-figure="${name}"]`).parentElement.querySelector('.tip');
  const box = words.getBoundingClientRect();
  return {
    lines: [...words.children].map((row) => row.textContent), visible: getComputedStyle(words).display !== 'none',
    inside: box.left >= 0 && box.right <= document.documentElement.clientWidth && box.top >= 0,
  };
}

// ---- Colours -------------------------------------------------------------------------------------

const known = new Map();

// [red, green, blue, alpha] of any CSS colour, 0 to 1.
function rgba(colour) {
  if (!known.has(colour)) {
    const canvas = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
    canvas.fillStyle = colour;
    canvas.fillRect(0, 0, 1, 1);
    known.set(colour, [...canvas.getImageData(0, 0, 1, 1).data].map((v) => v / 255));
  }
  return known.get(colour);
}

const luminance = (colour) => colour.slice(0, 3)
  .map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
  .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);

// WCAG 2.2, "contrast ratio".
function contrast(a, b) {
  const [x, y] = [luminance(a), luminance(b)];
  return (Math.max(x, y) + 0.05) / (Math.min(x, y) + 0.05);
}

function background(element) {
  for (let e = element; e; e = e.parentElement) {
    const colour = rgba(getComputedStyle(e).backgroundColor);
    if (colour[3] === 1) return colour;
  }
  return rgba('white');
}

// Fills that words of a figure may stand on: those that their middle is inside of.
function fills(text) {
  const box = text.getBoundingClientRect(), x = (box.left + box.right) / 2, y = (box.top + box.bottom) / 2;
  return [...text.ownerSVGElement.querySelectorAll('polygon, path')].filter((shape) => {
    const around = shape.getBoundingClientRect();
    return getComputedStyle(shape).fill !== 'none' && around.left < x && x < around.right && around.top < y && y < around.bottom;
  }).map((shape) => rgba(getComputedStyle(shape).fill));
}

// Every element with words of its own and too little contrast: what it says, the ratio.
function faint() {
  const found = [];
  for (const element of document.querySelectorAll('body *')) {
    if (['SCRIPT', 'STYLE'].includes(element.tagName)) continue;
    const own = [...element.childNodes].filter((n) => n.nodeType === Node.TEXT_NODE).map((n) => n.textContent.trim()).join('');
    if (!own || !element.checkVisibility()) continue;
    const style = getComputedStyle(element), drawn = element instanceof SVGElement;
    const size = parseFloat(style.fontSize) * 0.75, large = size >= 18 || (size >= 14 && Number(style.fontWeight) >= 700);
    const behind = drawn ? [background(element.ownerSVGElement.parentElement), ...fills(element.closest('text'))] : [background(element)];
    const ratio = Math.min(...behind.map((b) => contrast(rgba(drawn ? style.fill : style.color), b)));
    if (ratio < (large ? 3 : 4.5)) found.push(`"${own.slice(0, 60)}" has contrast ${ratio.toFixed(2)}`);
  }
  return found;
}

// The figures' colours, and the paper's.
function palette() {
  const style = getComputedStyle(document.documentElement), colours = [];
  for (let k = 0; style.getPropertyValue(`--figure-${k}`); k++) colours.push(rgba(style.getPropertyValue(`--figure-${k}`)).slice(0, 3));
  return { colours, paper: background(document.body).slice(0, 3) };
}

// ---- Keyboard and print --------------------------------------------------------------------------

// Every element that Tab should come to, in order.
function stops() {
  return [...document.querySelectorAll('a[href], input, summary, [tabindex="0"]')].filter((e) => e.checkVisibility()).length;
}

function focused() {
  const element = document.activeElement, style = getComputedStyle(element);
  return {
    what: element.outerHTML.slice(0, 100), body: element === document.body,
    outlined: style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2,
    contrast: contrast(rgba(style.outlineColor), background(element.parentElement)),
  };
}

const visible = (selector) => [...document.querySelectorAll(selector)].filter((e) => e.checkVisibility()).length;
const closed = () => document.querySelectorAll('details:not([open])').length;
