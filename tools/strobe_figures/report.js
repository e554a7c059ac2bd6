"use strict";
// Helpers of all scripts of the page, the color theme, and sorting of tables.

/** Returns a function (tag, attributes, ...children) that creates elements. An attribute whose value is a function becomes
 *  the listener of the event of that name; attributes with null or false are omitted. */
function elementFactory(create) {
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
const make = elementFactory((tag) => document.createElement(tag));
const makeSvg = elementFactory((tag) => document.createElementNS("http://www.w3.org/2000/svg", tag));

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const button = (name, click, attributes = {}) => make("button", { type: "button", click, ...attributes }, name);

/** Returns the JSON data of a figure. */
function dataOf(figure) {
  return JSON.parse(figure.querySelector('script[type="application/json"]').textContent);
}

/** Returns a power of ten as 10 with a superscript exponent. */
function powerOfTen(exponent) {
  return "10" + String(exponent).replace(/[-\d]/g, (sign) => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign]));
}

/** Returns a number as text with `digits` significant digits. */
function readable(value, digits = 4) {
  const size = Math.abs(value);
  if (!Number.isFinite(value)) return String(value);
  if (size === 0 || (size >= 1e-3 && size < 1e6)) return String(Number(value.toPrecision(digits))).replace("-", "−");
  const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  return `${Number(mantissa)} × ${powerOfTen(Number(exponent))}`.replace("-", "−");
}

/** Sets up the button that switches the color theme. The choice is stored if the browser allows it. */
function themeSwitch() {
  const control = document.querySelector(".theme");
  const systemTheme = matchMedia("(prefers-color-scheme: dark)");
  let chosen = null;
  try { chosen = localStorage.getItem("theme"); } catch { /* pages from disk may have no storage */ }
  const theme = () => chosen ?? (systemTheme.matches ? "dark" : "light");
  const show = () => {
    document.documentElement.style.colorScheme = chosen ?? "";
    control.textContent = theme() === "dark" ? "Light theme" : "Dark theme";
  };
  control.addEventListener("click", () => {
    chosen = theme() === "dark" ? "light" : "dark";
    try { localStorage.setItem("theme", chosen); } catch { /* the choice is lost when the page is closed */ }
    show();
  });
  systemTheme.addEventListener("change", show);
  control.hidden = false;
  show();
}

/** Compares two cells of a column. Empty cells and cells without a number come last in both directions. */
function compareCells(a, b, direction) {
  const [s, t] = [a.textContent, b.textContent];
  if (!a.matches(".number")) return direction * s.localeCompare(t, undefined, { numeric: true });
  const [x, y] = [a, b].map((cell) => parseFloat(cell.dataset.value.replace("inf", "Infinity")));
  if (Number.isNaN(x) || Number.isNaN(y)) return Number.isNaN(x) - Number.isNaN(y);
  return direction * (x < y ? -1 : x > y ? 1 : 0);
}

/** Makes the buttons in a table's header sort its rows, ascending first. */
function sortable(table) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => head.firstChild.addEventListener("click", () => {
    const ascending = head.ariaSort !== "ascending";
    heads.forEach((other) => { other.ariaSort = "none"; });
    head.ariaSort = ascending ? "ascending" : "descending";
    const rows = [...table.tBodies[0].rows];
    rows.sort((a, b) => compareCells(a.cells[column], b.cells[column], ascending ? 1 : -1));
    table.tBodies[0].append(...rows);
  }));
}

themeSwitch();
document.querySelectorAll("table").forEach(sortable);
