// Image comparison: a stage shows two images, separated by a wipe, or one image, at any exposure and zoom, or their error
// maps. Thumbnails of all images with their crops are below the stage.

const SHOWS = { picture: "Image", relative: "Relative error", absolute: "Absolute error" };
const SIDES = { wipe: "Wipe", A: "A", B: "B" };
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const KEYS = [["Space", "switch between A and B"], ["← →", "move the wipe; without a wipe, pan the image"],
  ["Shift + arrows", "pan the image"], ["+ − 0", "zoom in, zoom out, fit"], ["[ ]", "decrease, increase the exposure"],
  ["E", "switch between image, relative error and absolute error"], ["1 … 9", "select image B"]];

/** Returns a group of radio buttons drawn as one bar: { node, set(value) }. */
function choice(name, options, change) {
  const group = `choice-${choice.count = (choice.count ?? 0) + 1}`, inputs = {};
  const labels = Object.entries(options).map(([value, text]) => {
    inputs[value] = make("input", { type: "radio", name: group, value, change: () => change(value) });
    return make("label", {}, inputs[value], make("span", {}, text));
  });
  const node = make("fieldset", { class: "choice" }, make("legend", {}, name), make("div", {}, ...labels));
  return { node, set: (value) => { inputs[value].checked = true; } };
}

/** Returns a slider with its name and its value as text: { node, input, set(value, text) }. */
function slider(name, attributes, change) {
  const input = make("input", { type: "range", ...attributes, input: () => change(Number(input.value)) });
  const output = make("output");
  const node = make("label", { class: "slider" }, make("span", {}, name), input, output);
  return { node, input, set: (value, text) => { [input.value, output.textContent] = [value, text]; } };
}

class Viewer {
  constructor(figure, data, images) {
    Object.assign(this, { data, images });
    const first = data.reference === 0 && images.length > 1 ? 1 : 0;
    const partner = data.reference ?? images.length - 1;
    this.state = { A: first, B: partner, side: "wipe", show: "picture", wipe: 0.5, zoom: 1,
      x: data.width / 2, y: data.height / 2, stops: { picture: 0, relative: 0, absolute: 0 } };
    this.drawn = new Map();
    figure.append(this.buildControls(), this.buildStage(), this.buildStrip());
    new ResizeObserver(() => this.update()).observe(this.stage);
  }

  // Building

  buildControls() {
    const { images, reference, crops } = this.data;
    this.selects = ["A", "B"].map((side) => {
      const options = images.map((image, i) => make("option", { value: i }, image.label));
      return make("select", { change: (event) => this.set({ [side]: Number(event.target.value) }) }, ...options);
    });
    const [a, b] = this.selects.map((select, i) => make("label", { class: "pick" }, "AB"[i], select));
    this.side = choice("Compare", SIDES, (side) => this.set({ side }));
    this.show = choice("Show", SHOWS, (show) => this.set({ show }));
    if (reference === null) this.show.node.hidden = true;
    this.exposure = slider("Exposure", { min: -8, max: 8, step: 0.25 }, (stops) => this.setStops(stops));
    const zoom = make("div", { class: "zoom", role: "group", "aria-label": "Zoom" },
      button("−", () => this.zoomBy(0.5), { "aria-label": "Zoom out" }),
      button("+", () => this.zoomBy(2), { "aria-label": "Zoom in" }), button("Fit", () => this.fit()),
      ...crops.map((crop, i) => button(`Crop ${i + 1}`, () => this.zoomTo(crop), { class: `crop c${i % 4}` })));
    const swap = button("⇄", () => this.swap(), { "aria-label": "Swap A and B" });
    return make("div", { class: "controls" }, make("div", { class: "pair" }, a, swap, b), this.side.node,
      button("Flip", () => this.flip(), { class: "flip" }), this.show.node, this.exposure.node, zoom);
  }

  buildStage() {
    const { width, height } = this.data;
    this.canvas = make("canvas");
    this.names = ["A", "B"].map((side) => make("span", { class: `name ${side}` }));
    this.divider = make("div", { class: "divider" });
    const drop = () => { this.drag = null; };
    const listeners = { keydown: (event) => this.key(event), pointerdown: (event) => this.press(event),
      pointermove: (event) => this.move(event), pointerup: drop, pointercancel: drop,
      pointerleave: () => this.read(null) };
    const label = `${this.data.title}: stage`;
    this.stage = make("div", { class: "stage", tabindex: 0, role: "group", "aria-label": label, ...listeners },
      this.canvas, this.divider, ...this.names);
    this.stage.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    this.stage.style.aspectRatio = `${width} / ${height}`;
    this.wipe = slider("Wipe", { min: 0, max: 1, step: 0.005 }, (wipe) => this.set({ wipe, side: "wipe" }));
    this.values = make("p", { class: "readout" });
    this.scale = make("p", { class: "scale" }, make("span"), make("canvas", { width: 200, height: 1 }), make("span"));
    const keys = KEYS.flatMap(([key, action]) => [make("dt", {}, key), make("dd", {}, action)]);
    const hints = make("details", { class: "keys" }, make("summary", {}, "Keyboard shortcuts"), make("dl", {}, ...keys));
    const screen = make("div", { class: "screen" }, this.stage, this.wipe.node, this.scale, this.values, hints);
    screen.style.maxWidth = `calc(76vh * ${width / height})`;
    return screen;
  }

  buildStrip() {
    const { width, height, images, crops } = this.data;
    this.thumbnails = images.map((image, i) => {
      const whole = make("canvas", { width, height });
      const cropped = crops.map(([, , w, h], k) => make("canvas", { width: w, height: h, class: `crop c${k % 4}` }));
      const label = `Show ${image.label} as B`, choose = () => this.set({ B: i });
      const chosen = make("button", { type: "button", "aria-label": label, click: choose }, whole, ...cropped);
      const caption = make("figcaption", {}, make("b", {}, image.label), image.caption ? ` ${image.caption}` : "");
      return { whole, cropped, chosen, node: make("figure", {}, chosen, caption) };
    });
    return make("div", { class: "strip" }, ...this.thumbnails.map((thumbnail) => thumbnail.node));
  }

  // State

  set(changes) {
    Object.assign(this.state, changes);
    this.update();
  }

  setStops(stops) { this.set({ stops: { ...this.state.stops, [this.state.show]: clamp(stops, -8, 8) } }); }
  swap() { this.set({ A: this.state.B, B: this.state.A }); }
  flip() { this.set({ side: this.state.side === "A" ? "B" : "A" }); }
  fit() { this.set({ zoom: 1 }); }
  zoomBy(factor) { this.set({ zoom: clamp(this.state.zoom * factor, 1, 64) }); }

  zoomTo([x, y, w, h]) {
    const zoom = Math.min(this.data.width / w, this.data.height / h);
    this.set({ zoom: clamp(zoom, 1, 64), x: x + w / 2, y: y + h / 2 });
  }

  /** Pans the image by fractions of its visible width and height. */
  pan(dx, dy) {
    const { x, y, zoom } = this.state;
    this.set({ x: x + dx * this.data.width / zoom, y: y + dy * this.data.height / zoom });
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { side, show, wipe, stops } = this.state, count = Math.min(9, this.images.length);
    const shows = this.data.reference === null ? ["picture"] : Object.keys(SHOWS);
    const [dx, dy] = ARROWS[event.key] ?? [0, 0];
    const action = {
      " ": () => this.flip(), 0: () => this.fit(),
      "+": () => this.zoomBy(2), "=": () => this.zoomBy(2), "-": () => this.zoomBy(0.5),
      "[": () => this.setStops(stops[show] - 0.5), "]": () => this.setStops(stops[show] + 0.5),
      e: () => this.set({ show: shows[(shows.indexOf(show) + 1) % shows.length] }),
    }[event.key.toLowerCase()];
    if (action) action();
    else if (dx && side === "wipe" && !event.shiftKey) this.set({ wipe: clamp(wipe + 0.02 * dx, 0, 1) });
    else if (dx || (dy && this.state.zoom > 1)) this.pan(dx / 10, dy / 10);
    else if (event.key >= "1" && event.key <= String(count)) this.set({ B: Number(event.key) - 1 });
    else return;
    event.preventDefault();
  }

  // Pointer: drags the wipe, or pans a zoomed image if the wipe is not near

  /** Returns the position of an event on the stage, from (0, 0) to (1, 1). */
  positionOf(event) {
    const box = this.stage.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  }

  press(event) {
    if (event.button !== 0) return;
    const { side, wipe, zoom } = this.state;
    const near = Math.abs(this.positionOf(event)[0] - wipe) * this.stage.clientWidth < 16;
    this.drag = side === "wipe" && (near || zoom === 1) ? "wipe" : "pan";
    this.stage.setPointerCapture(event.pointerId);
    this.last = this.positionOf(event);
    this.move(event);
  }

  move(event) {
    const [u, v] = this.positionOf(event);
    if (this.drag === "wipe") this.set({ wipe: clamp(u, 0, 1) });
    if (this.drag === "pan") this.pan(this.last[0] - u, this.last[1] - v);
    this.last = [u, v];
    const { x, y, zoom } = this.state;
    this.read([x + (u - 0.5) * this.data.width / zoom, y + (v - 0.5) * this.data.height / zoom].map(Math.floor));
  }

  wheel(event) {
    if (!event.ctrlKey && !event.metaKey) return; // without Ctrl, the wheel scrolls the page
    event.preventDefault();
    this.zoomBy(2 ** (-event.deltaY / 200));
  }

  /** Shows the values of a pixel below the stage; null clears them. */
  read(pixel) {
    const { width, height } = this.data;
    if (!pixel || pixel.some((v, i) => v < 0 || v >= [width, height][i])) return this.values.replaceChildren();
    const offset = 3 * (pixel[1] * width + pixel[0]);
    const rgb = (i) => [0, 1, 2].map((k) => readable(HALF[this.images[i].bits[offset + k]], 3)).join(" ");
    const values = ["A", "B"].flatMap((side) => [make("b", {}, `${side} `), `${rgb(this.state[side])}  `]);
    this.values.replaceChildren(`Pixel ${pixel.join(", ")}  `, ...values);
  }

  // Drawing

  /** Returns a key of the content and the exposure of all images. */
  drawingKey() {
    return `${this.state.show} ${this.state.stops[this.state.show]}`;
  }

  /** Returns the canvas of an image, or of its error map, at the current exposure. */
  canvasOf(i) {
    const { show, stops: { [show]: stops } } = this.state, key = this.drawingKey();
    if (this.drawn.get(i)?.key !== key) {
      const canvas = show === "picture" ? picture(this.images[i], stops)
        : errorMap(this.images[i], this.images[this.data.reference], show === "relative", stops);
      this.drawn.set(i, { key, canvas });
    }
    return this.drawn.get(i).canvas;
  }

  /** Redraws with the next frame, once for any number of calls. */
  update() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = null;
      this.showState();
      this.drawStage();
      this.drawStrip();
    });
  }

  showState() {
    const { state, data } = this, half = 0.5 / state.zoom;
    state.x = clamp(state.x, half * data.width, (1 - half) * data.width);
    state.y = clamp(state.y, half * data.height, (1 - half) * data.height);
    const stops = state.stops[state.show], sign = stops < 0 ? "−" : stops > 0 ? "+" : "";
    this.selects.forEach((select, i) => { select.value = state["AB"[i]]; });
    this.side.set(state.side);
    this.show.set(state.show);
    this.exposure.set(stops, `${sign}${Math.abs(stops)} EV`);
    this.wipe.set(state.wipe, `${Math.round(100 * state.wipe)} %`);
    this.stage.classList.toggle("zoomed", state.zoom > 1);
    this.names.forEach((name, i) => {
      name.textContent = `${"AB"[i]}  ${data.images[state["AB"[i]]].label}`;
      name.hidden = state.side !== "wipe" && state.side !== "AB"[i];
    });
    this.divider.hidden = state.side !== "wipe";
    this.divider.style.left = `${100 * state.wipe}%`;
    this.thumbnails.forEach(({ chosen }, i) => chosen.setAttribute("aria-pressed", i === state.B));
    this.showScale(stops);
  }

  showScale(stops) {
    const [from, bar, to] = this.scale.children, { show } = this.state;
    this.scale.hidden = show === "picture";
    if (this.scale.hidden) return;
    const over = show === "relative" ? ", relative to the reference plus 1 % of its mean" : "";
    from.textContent = `Mean of |Δ| over R, G, B${over}:  0`;
    to.textContent = readable(2 ** -stops, 3);
    const context = bar.getContext("2d");
    for (let x = 0; x < bar.width; ++x) {
      context.fillStyle = `rgb(${heat(x / (bar.width - 1)).join(" ")})`;
      context.fillRect(x, 0, 1, 1);
    }
  }

  drawStage() {
    const { canvas, data: { width, height }, state: { A, B, side, wipe, zoom, x, y } } = this;
    const { clientWidth, clientHeight } = this.stage;
    const [wide, tall] = [clientWidth, clientHeight].map((size) => Math.round(size * devicePixelRatio));
    if (!wide || !tall) return;
    [canvas.width, canvas.height] = [wide, tall];
    const context = canvas.getContext("2d"), scale = wide / width * zoom;
    const target = [wide / 2 - x * scale, tall / 2 - y * scale, width * scale, height * scale];
    context.imageSmoothingEnabled = scale < 1;
    context.drawImage(this.canvasOf(side === "B" ? B : A), ...target);
    if (side !== "wipe") return;
    const edge = Math.round(wipe * wide);
    context.beginPath();
    context.rect(edge, 0, wide - edge, tall);
    context.clip();
    context.drawImage(this.canvasOf(B), ...target);
  }

  drawStrip() {
    const key = this.drawingKey();
    if (this.stripShows === key) return;
    this.stripShows = key;
    this.thumbnails.forEach(({ whole, cropped }, i) => {
      const canvas = this.canvasOf(i), context = whole.getContext("2d");
      context.drawImage(canvas, 0, 0);
      this.data.crops.forEach(([x, y, w, h], k) => {
        cropped[k].getContext("2d").drawImage(canvas, -x, -y);
        context.strokeStyle = getComputedStyle(cropped[k]).borderTopColor;
        context.lineWidth = Math.max(1, whole.width / 120);
        context.strokeRect(x, y, w, h);
      });
    });
  }
}

document.querySelectorAll("figure.images").forEach(async (figure) => {
  const data = dataOf(figure);
  const images = await Promise.all(data.images.map((image) => imageOf(image.pixels)));
  new Viewer(figure, data, images);
});
