"use strict";
// What all parts of the page share, then the theme and the tables.

/** Makes elements of a namespace: (tag, attributes, ...children). An attribute that is a function hears the event of
 *  its name; null and false leave an attribute out. */
function maker(create) {
  return (tag, attributes = {}, ...children) => {
    const node = create(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (typeof value === "function") node.addEventListener(name, value);
      else if (value !== null && value !== false) node.setAttribute(name, value);
    }
    node.append(...children);
    return node;
  };
}
const make = maker((tag) => document.createElement(tag));
const makeSvg = maker((tag) => document.createElementNS("http://www.w3.org/2000/svg", tag));

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const button = (name, click, attributes = {}) => make("button", { type: "button", click, ...attributes }, name);

/** The data that stand in a figure as JSON. */
function dataOf(figure) {
  return JSON.parse(figure.querySelector('script[type="application/json"]').textContent);
}

/** A power of ten as 10 with a raised exponent. */
function powerOfTen(exponent) {
  return "10" + String(exponent).replace(/[-\d]/g, (sign) => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign]));
}

/** A number for people, to so many digits. */
function readable(value, digits = 4) {
  const size = Math.abs(value);
  if (!Number.isFinite(value)) return String(value);
  if (size === 0 || (size >= 1e-3 && size < 1e6)) return String(Number(value.toPrecision(digits))).replace("-", "−");
  const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  return `${Number(mantissa)} × ${powerOfTen(Number(exponent))}`.replace("-", "−");
}

/** The button that turns light to dark; the choice outlives the page where the browser lets it. */
function themeSwitch() {
  const control = document.querySelector(".theme");
  const wish = matchMedia("(prefers-color-scheme: dark)");
  let chosen = null;
  try { chosen = localStorage.getItem("theme"); } catch { /* a page from disk may have no storage */ }
  const theme = () => chosen ?? (wish.matches ? "dark" : "light");
  const show = () => {
    document.documentElement.style.colorScheme = chosen ?? "";
    control.textContent = theme() === "dark" ? "Light theme" : "Dark theme";
  };
  control.addEventListener("click", () => {
    chosen = theme() === "dark" ? "light" : "dark";
    try { localStorage.setItem("theme", chosen); } catch { /* then it lasts as long as the page */ }
    show();
  });
  wish.addEventListener("change", show);
  control.hidden = false;
  show();
}

/** Compares two cells of a column; empty cells and what is no number come last, whichever way the others go. */
function compareCells(a, b, direction) {
  const [s, t] = [a.textContent, b.textContent];
  if (!a.matches(".number")) return direction * s.localeCompare(t, undefined, { numeric: true });
  const [x, y] = [a, b].map((cell) => parseFloat(cell.dataset.value.replace("inf", "Infinity")));
  if (Number.isNaN(x) || Number.isNaN(y)) return Number.isNaN(x) - Number.isNaN(y);
  return direction * (x < y ? -1 : x > y ? 1 : 0);
}

/** Lets the buttons in a table's head sort its rows, upwards first. */
function sortable(table) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => head.firstChild.addEventListener("click", () => {
    const upwards = head.ariaSort !== "ascending";
    heads.forEach((other) => { other.ariaSort = "none"; });
    head.ariaSort = upwards ? "ascending" : "descending";
    const rows = [...table.tBodies[0].rows];
    rows.sort((a, b) => compareCells(a.cells[column], b.cells[column], upwards ? 1 : -1));
    table.tBodies[0].append(...rows);
  }));
}

themeSwitch();
document.querySelectorAll("table").forEach(sortable);
