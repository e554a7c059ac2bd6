// Charts: axes, series with confidence bands, a legend that hides series, and the values of the point nearest to the
// pointer.

const MARGIN = { left: 68, right: 18, top: 22, bottom: 52 };
const PRINTED_WIDTH = 680;
// By palette index, as in styles.py: circle, square, triangles, diamond, plus, cross, triangle, pentagon, hexagon.
const MARKERS = [
  "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0Z", "M-3.6-3.6H3.6V3.6H-3.6Z", "M0-4.8L4.6 3.4H-4.6Z", "M0-5.2L5.2 0L0 5.2L-5.2 0Z",
  "M0 4.8L4.6-3.4H-4.6Z", "M-1.5-4.5H1.5V-1.5H4.5V1.5H1.5V4.5H-1.5V1.5H-4.5V-1.5H-1.5Z",
  "M-4.4-2.3L-2.3-4.4L0-2.1L2.3-4.4L4.4-2.3L2.1 0L4.4 2.3L2.3 4.4L0 2.1L-2.3 4.4L-4.4 2.3L-2.1 0Z", "M-5 0L3.4-4.6V4.6Z",
  "M0-4.8L4.6-1.5L2.8 3.9H-2.8L-4.6-1.5Z", "M0-4.8L4.2-2.4V2.4L0 4.8L-4.2 2.4V-2.4Z",
];

/** Returns 1, 2 or 5 times a power of ten, so that about `count` steps fit into the span. */
function niceStep(span, count) {
  const rough = span / count, power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
}

/** Returns the ticks of a linear axis: [value, text]. */
function linearTicks(low, high, count) {
  const step = niceStep(high - low, count), first = Math.ceil(low / step - 1e-9);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), plain = digits < 5 && high < 1e6;
  const ticks = [];
  for (let i = first; i * step <= high + step * 1e-9; ++i) {
    ticks.push([i * step, plain ? (i * step).toFixed(digits).replace("-", "−") : readable(i * step)]);
  }
  return ticks;
}

/** Returns the ticks of a logarithmic axis: [value, text]. At most about `room` powers of ten have a text. If the axis
 *  spans few decades, 2 and 5 have a text as well; below 0.7 decades all digits do. */
function logTicks(low, high, room) {
  const decades = Math.log10(high / low), every = Math.max(1, Math.ceil(decades / room));
  const plain = low >= 1e-3 && high <= 1e5;
  const named = decades < 0.7 ? [1, 2, 3, 4, 5, 6, 7, 8, 9] : decades < 2.2 && room > 5 ? [1, 2, 5] : [1];
  const ticks = [];
  for (let exponent = Math.floor(Math.log10(low)); exponent <= Math.log10(high); ++exponent) {
    for (let digit = 1; digit < 10; ++digit) {
      const value = digit * 10 ** exponent;
      if (value < low * 0.999999 || value > high * 1.000001) continue;
      const text = named.includes(digit) && exponent % every === 0;
      ticks.push([value, !text ? "" : plain || digit > 1 ? readable(value, 3) : powerOfTen(exponent)]);
    }
  }
  return ticks;
}

/** Returns an axis over the values: position(value) in 0..1 and ticks(room). A linear axis starts at zero if the smallest
 *  value is below half of the largest; both ends have a margin. */
function makeAxis(values, log) {
  let low = Math.min(...values), high = Math.max(...values);
  if (log) {
    const margin = Math.max((high / low) ** 0.04, 1.1);
    [low, high] = [low / margin, high * margin];
    const position = (v) => Math.log(v / low) / Math.log(high / low);
    return { low, high, position, ticks: (room) => logTicks(low, high, room) };
  }
  if (low > 0 && low < high / 2) low = 0;
  const margin = (high - low || Math.abs(high) || 1) * 0.04;
  [low, high] = [low === 0 ? 0 : low - margin, high + margin];
  return { low, high, position: (v) => (v - low) / (high - low), ticks: (room) => linearTicks(low, high, room) };
}

class Chart {
  constructor(figure) {
    this.data = dataOf(figure);
    this.data.series.forEach((series) => { series.style = `series s${series.palette}`; });
    this.hidden = new Set();
    this.current = null;
    this.buildAxes();
    const label = `${this.data.title}. Arrow keys step through the points.`;
    this.svg = makeSvg("svg", { role: "group", tabindex: 0, "aria-label": label,
      pointermove: (event) => this.point(event), pointerdown: (event) => this.point(event),
      pointerleave: () => this.show(null), blur: () => this.show(null), keydown: (event) => this.key(event) });
    this.ring = makeSvg("circle", { class: "ring", r: 8, visibility: "hidden" });
    this.tip = make("output", { class: "tip", hidden: "" });
    this.plot = make("div", { class: "plot" }, this.svg, this.tip);
    figure.querySelector("figcaption").after(this.plot, this.legend());
    new ResizeObserver(() => this.draw()).observe(this.plot);
    addEventListener("beforeprint", () => this.draw(PRINTED_WIDTH));
    addEventListener("afterprint", () => this.draw());
  }

  buildAxes() {
    const { series, marks, xlog, ylog } = this.data;
    const points = series.flatMap((entry) => entry.points);
    const isShown = (value) => value !== null && (!ylog || value > 0);
    this.x = makeAxis([...points.map((p) => p[0]), ...marks.map((m) => m.x).filter((x) => !xlog || x > 0)], xlog);
    this.y = makeAxis(points.flatMap((p) => p.slice(1)).filter(isShown), ylog);
  }

  legend() {
    const entry = (series, i) => {
      const swatch = makeSvg("svg", { class: series.style, viewBox: "0 0 46 14", "aria-hidden": "true" },
        this.line(series, "M1 7H45"), ...(series.front ? [] : [this.marker(series, 23, 7)]));
      const toggle = (event) => {
        if (!this.hidden.delete(i)) this.hidden.add(i);
        event.currentTarget.setAttribute("aria-pressed", !this.hidden.has(i));
        this.show(null);
        this.draw();
      };
      return button(swatch, toggle, { "aria-pressed": "true" });
    };
    const buttons = this.data.series.map((series, i) => {
      const item = entry(series, i);
      item.append(series.name);
      return item;
    });
    return make("div", { class: "legend", role: "group", "aria-label": "Series; press to hide or show" }, ...buttons);
  }

  line(series, path) {
    return makeSvg("path", { class: `line v${series.variant}${series.front ? " front" : ""}`, d: path });
  }

  /** Returns a marker; it is hollow for parameters that differ from the defaults. */
  marker(series, x, y) {
    const kind = "marker" + (series.variant ? " hollow" : "");
    return makeSvg("path", { class: kind, d: MARKERS[series.palette], transform: `translate(${x} ${y})` });
  }

  /** Returns the pixel of values. A low end of a band that is not positive lies at the bottom of a logarithmic axis. */
  pixelOf(x, y) {
    const height = this.data.ylog && y <= 0 ? 0 : this.y.position(y);
    return [MARGIN.left + this.x.position(x) * this.inner.width, MARGIN.top + (1 - height) * this.inner.height];
  }

  /** Draws with a width in pixels, which differs between window and print. */
  draw(width = this.plot.clientWidth) {
    const height = clamp(width * 0.5, 260, 440);
    if (width === 0) return;
    this.inner = { width: width - MARGIN.left - MARGIN.right, height: height - MARGIN.top - MARGIN.bottom };
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const visible = this.data.series.map((series, i) => [series, i]).filter(([, i]) => !this.hidden.has(i));
    visible.sort(([a], [b]) => b.front - a.front);
    const lines = visible.map(([series]) => this.drawSeries(series));
    this.svg.replaceChildren(...this.drawAxes(height), ...this.drawMarks(), ...lines, this.ring);
    if (this.current) this.show(this.current);
  }

  drawAxes(height) {
    const { left, top } = MARGIN, { width, height: tall } = this.inner, bottom = top + tall;
    const nodes = [];
    const text = (content, attributes) => nodes.push(makeSvg("text", attributes, content));
    for (const [value, name] of this.x.ticks(width / 70)) {
      const x = left + this.x.position(value) * width;
      nodes.push(makeSvg("path", { class: name ? "grid" : "grid minor", d: `M${x} ${top}V${bottom}` }));
      if (name) text(name, { class: "tick", x, y: bottom + 18, "text-anchor": "middle" });
    }
    for (const [value, name] of this.y.ticks(tall / 45)) {
      const y = bottom - this.y.position(value) * tall;
      nodes.push(makeSvg("path", { class: name ? "grid" : "grid minor", d: `M${left} ${y}H${left + width}` }));
      if (name) text(name, { class: "tick", x: left - 8, y: y + 4, "text-anchor": "end" });
    }
    nodes.push(makeSvg("path", { class: "axis", d: `M${left} ${top}V${bottom}H${left + width}` }));
    text(this.data.xlabel, { class: "name", x: left + width / 2, y: height - 8, "text-anchor": "middle" });
    const upright = `translate(14 ${top + tall / 2}) rotate(-90)`;
    text(this.data.ylabel, { class: "name", "text-anchor": "middle", transform: upright });
    return nodes;
  }

  drawMarks() {
    return this.data.marks.filter((mark) => !this.data.xlog || mark.x > 0).map((mark) => {
      const [x] = this.pixelOf(mark.x, this.y.low), left = this.x.position(mark.x) > 0.7;
      const text = { x: left ? x - 5 : x + 5, y: MARGIN.top + 12, "text-anchor": left ? "end" : "start" };
      return makeSvg("g", { class: "mark" }, makeSvg("path", { d: `M${x} ${MARGIN.top}v${this.inner.height}` }),
        makeSvg("text", text, mark.label));
    });
  }

  drawSeries(series) {
    const group = makeSvg("g", { class: series.style });
    const pixels = series.points.map(([x, y]) => this.pixelOf(x, y));
    const banded = series.points.filter((point) => point[2] !== null);
    const low = banded.map(([x, , v]) => this.pixelOf(x, v)), high = banded.map(([x, , , v]) => this.pixelOf(x, v));
    if (banded.length > 1) {
      group.append(makeSvg("path", { class: "band", d: `M${low.join("L")}L${high.reverse().join("L")}Z` }));
      high.reverse();
    }
    low.forEach(([x, y], k) => group.append(makeSvg("path", { class: "whisker", d: `M${x} ${y}V${high[k][1]}` })));
    if (pixels.length > 1) group.append(this.line(series, `M${pixels.join("L")}`));
    if (!series.front) pixels.forEach(([x, y]) => group.append(this.marker(series, x, y)));
    return group;
  }

  /** Shows the values of the point nearest to the pointer. Points of other series take precedence over equal points of the
   *  Pareto front. */
  point(event) {
    const box = this.svg.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left, event.clientY - box.top];
    let best = null, nearest = Infinity;
    this.data.series.forEach((series, i) => series.points.forEach(([x, y], k) => {
      const [sx, sy] = this.pixelOf(x, y), distance = Math.hypot(sx - px, sy - py);
      const better = distance < nearest || (distance === nearest && this.data.series[best.i].front);
      if (!this.hidden.has(i) && better) [best, nearest] = [{ i, k }, distance];
    }));
    this.show(best);
  }

  key(event) {
    const { series } = this.data;
    const shown = series.map((_, i) => i).filter((i) => !this.hidden.has(i) && series[i].points.length);
    const step = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowDown: [1, 0], ArrowUp: [-1, 0] }[event.key];
    if (event.key === "Escape") this.show(null);
    if (!step || !shown.length) return;
    event.preventDefault();
    if (!this.current) return this.show({ i: shown[0], k: 0 });
    const i = shown[(shown.indexOf(this.current.i) + step[0] + shown.length) % shown.length];
    this.show({ i, k: clamp(this.current.k + step[1], 0, series[i].points.length - 1) });
  }

  /** Marks a point, {i: series, k: point}, with a ring and shows its values; null removes both. */
  show(point) {
    this.current = point;
    this.tip.hidden = point === null;
    this.ring.setAttribute("visibility", point ? "visible" : "hidden");
    if (!point) return;
    const series = this.data.series[point.i], label = series.labels[point.k];
    const [x, y, low, high] = series.points[point.k];
    const [px, py] = this.pixelOf(x, y);
    this.ring.setAttribute("transform", `translate(${px} ${py})`);
    const row = (name, value) => make("span", {}, `${name} `, make("b", {}, value));
    const band = low === null ? [] : [row("from", readable(low)), row("to", readable(high))];
    this.tip.replaceChildren(make("strong", {}, label ? `${series.name}, ${label}` : series.name),
      row(this.data.xlabel, readable(x)), row(this.data.ylabel, readable(y)), ...band);
    const { offsetWidth: w, offsetHeight: h } = this.tip;
    this.tip.style.left = `${clamp(px + 14, 0, Math.max(0, this.plot.clientWidth - w))}px`;
    this.tip.style.top = `${py - h - 12 < 0 ? py + 14 : py - h - 12}px`;
  }
}

document.querySelectorAll("figure.chart").forEach((figure) => new Chart(figure));
