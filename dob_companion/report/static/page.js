// Hover readout and zoom for the figures of a report. Without it the page is complete; nothing is fetched.
// Each <figure class="chart"> holds an SVG drawn by matplotlib and the same curves as JSON. At rest the SVG is shown
// as it is; a zoomed column hides its static curves and ticks and draws them again from the data.
"use strict";
(() => {
  const NS = "http://www.w3.org/2000/svg";
  const make = (name, attributes, parent) => {
    const node = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    return parent ? parent.appendChild(node) : node;
  };
  const unpack = (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  };
  const format = (value) => {
    if (!Number.isFinite(value)) return "–";
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-4 || size >= 1e5)) return value.toExponential(2).replace("-", "−");
    return value.toFixed(size >= 100 ? 1 : size >= 10 ? 2 : size >= 1 ? 3 : 4).replace("-", "−");
  };

  // One axis: value <-> pixel, its ticks, and zooming about a pixel.
  const axisOf = (spec, from, to) => {
    const bend = spec.log ? Math.log10 : (v) => v;
    const unbend = spec.log ? (v) => 10 ** v : (v) => v;
    const axis = {
      lim: [...spec.lim],
      home: spec.lim,
      pixel: (v) => from + ((bend(v) - bend(axis.lim[0])) / (bend(axis.lim[1]) - bend(axis.lim[0]))) * (to - from),
      value: (p) => unbend(bend(axis.lim[0]) + ((p - from) / (to - from)) * (bend(axis.lim[1]) - bend(axis.lim[0]))),
      set: (a, b) => { if (Math.abs(bend(b) - bend(a)) > 1e-9) axis.lim = a < b ? [a, b] : [b, a]; },
      ticks: (count) => {
        const [low, high] = axis.lim;
        if (spec.names?.length) return [...spec.names.keys()].filter((v) => v >= low && v <= high);
        if (spec.log && high / low > 8) {
          const marks = [];
          const some = high / low > 200 ? [1] : [1, 2, 5];
          for (let k = Math.floor(Math.log10(low)); k <= Math.log10(high); k++)
            for (const m of some) if (m * 10 ** k >= low && m * 10 ** k <= high) marks.push(m * 10 ** k);
          return marks;
        }
        const raw = (high - low) / count, unit = 10 ** Math.floor(Math.log10(raw));
        const step = [1, 2, 2.5, 5, 10].find((m) => m * unit >= raw) * unit;
        const marks = [];
        for (let i = Math.ceil(low / step); i * step <= high + step * 1e-9; i++) marks.push(i * step);
        return marks;
      },
      label: (v) => spec.names?.[v] ?? String(+v.toPrecision(6)).replace("-", "−"),
      say: (v) => (spec.names?.length ? spec.names[Math.round(v)] ?? "" : `${format(v)} ${spec.unit}`),
    };
    return axis;
  };

  class Chart {
    constructor(figure) {
      this.figure = figure;
      this.svg = figure.querySelector("svg");
      this.spec = JSON.parse(figure.querySelector("script").textContent);
      this.xs = this.spec.xs.map(unpack);
      this.columns = new Map();
      this.panels = this.spec.panels.map((spec, index) => this.panel(spec, index));
      this.readout = figure.appendChild(document.createElement("div"));
      this.readout.className = "readout";
      this.readout.hidden = true;
      this.listen();
    }

    panel(spec, index) {
      const [left, top, width, height] = spec.box;
      if (!this.columns.has(spec.col)) this.columns.set(spec.col, axisOf(spec.x, left, left + width));
      const prefix = `${this.figure.dataset.key}-p${index}-`;
      const clip = make("clipPath", { id: `${prefix}clip` }, this.svg);
      make("rect", { x: left, y: top, width, height }, clip);
      const curves = spec.curves.map((c) => ({ ...c, x: this.xs[c.x], y: unpack(c.y), along: c.along && unpack(c.along) }));
      const bands = spec.bands.map((b) => ({ ...b, x: this.xs[b.x], low: unpack(b.low), high: unpack(b.high) }));
      return {
        spec, left, top, width, height, curves, bands, prefix,
        x: this.columns.get(spec.col), y: axisOf(spec.y, top + height, top),
        still: this.svg.querySelectorAll(`[id^="${prefix}"]:not(clipPath)`),
        live: make("g", { class: "live" }, this.svg), over: make("g", { class: "over" }, this.svg),
      };
    }

    // Pixels of the screen -> pixels of the SVG.
    place(event) {
      const area = this.svg.getBoundingClientRect();
      return [((event.clientX - area.left) / area.width) * this.spec.width,
        ((event.clientY - area.top) / area.height) * this.spec.height];
    }

    find([px, py]) {
      return this.panels.find((p) => px >= p.left && px <= p.left + p.width && py >= p.top - 4 && py <= p.top + p.height + 4);
    }

    listen() {
      let start = null;
      this.svg.addEventListener("pointerdown", (event) => {
        if (event.pointerType !== "mouse" || event.button !== 0) return;
        const panel = this.find(this.place(event));
        if (!panel) return;
        start = { at: this.place(event), panel };
        this.svg.setPointerCapture(event.pointerId);
        event.preventDefault();
      });
      this.svg.addEventListener("pointermove", (event) => {
        const at = this.place(event);
        if (start) this.rubber(start, at); else this.hover(event, this.find(at), at);
      });
      this.svg.addEventListener("pointerup", (event) => {
        if (start) this.release(start, this.place(event));
        start = null;
      });
      this.svg.addEventListener("pointerleave", () => { if (!start) this.clear(); });
      this.svg.addEventListener("dblclick", () => this.reset());
      // A plain wheel scrolls the page; with Ctrl (which is what a pinch sends) it zooms.
      this.svg.addEventListener("wheel", (event) => {
        const at = this.place(event), panel = this.find(at);
        if (!panel || !event.ctrlKey) return;
        event.preventDefault();
        const by = Math.exp(Math.max(-1, Math.min(1, event.deltaY / 200)));
        const edge = (side) => panel.x.value(at[0] + (side - at[0]) * by);
        panel.x.set(edge(panel.left), edge(panel.left + panel.width));
        this.draw();
      }, { passive: false });
    }

    clear() {
      this.readout.hidden = true;
      for (const p of this.panels) p.over.replaceChildren();
    }

    rubber({ at: [x0, y0], panel }, [x1, y1]) {
      this.clear();
      const tall = Math.abs(y1 - y0) > 14;
      const y = tall ? Math.min(y0, y1) : panel.top, height = tall ? Math.abs(y1 - y0) : panel.height;
      make("rect", { class: "rubber", x: Math.min(x0, x1), y, width: Math.abs(x1 - x0), height }, panel.over);
    }

    // A flat drag zooms x alone, a box zooms both.
    release({ at: [x0, y0], panel }, [x1, y1]) {
      this.clear();
      const hold = (v, low, high) => Math.min(Math.max(v, low), high);
      if (Math.abs(x1 - x0) < 6) return;
      if (Math.abs(y1 - y0) > 14) {
        const rows = [y0, y1].map((v) => panel.y.value(hold(v, panel.top, panel.top + panel.height)));
        panel.y.set(rows[0], rows[1]);
      }
      const ends = [x0, x1].map((v) => panel.x.value(hold(v, panel.left, panel.left + panel.width)));
      panel.x.set(ends[0], ends[1]);
      this.draw();
    }

    reset() {
      for (const p of this.panels) { p.x.lim = [...p.x.home]; p.y.lim = [...p.y.home]; }
      this.draw();
    }

    draw() {
      for (const p of this.panels) {
        const moved = [p.x, p.y].some((a) => a.lim[0] !== a.home[0] || a.lim[1] !== a.home[1]);
        for (const node of p.still) node.style.display = moved ? "none" : "";
        p.live.replaceChildren();
        if (moved) this.redraw(p);
      }
    }

    redraw(p) {
      const right = p.left + p.width, base = p.top + p.height;
      const line = (x1, y1, x2, y2, kind) => make("line", { class: kind, x1, y1, x2, y2 }, p.live);
      const word = (text, x, y, anchor) => { make("text", { class: "tick", x, y, "text-anchor": anchor }, p.live).textContent = text; };
      for (const v of p.x.ticks(p.width / 80)) {
        line(p.x.pixel(v), p.top, p.x.pixel(v), base, "grid");
        if (p.spec.bottom) word(p.x.label(v), p.x.pixel(v), base + 15, "middle");
      }
      for (const v of p.y.ticks(5)) {
        line(p.left, p.y.pixel(v), right, p.y.pixel(v), "grid");
        word(p.y.label(v), p.left - 6, p.y.pixel(v) + 4, "end");
      }
      if (p.spec.bottom) word(p.spec.x.unit ? `${p.spec.x.label}, ${p.spec.x.unit}` : p.spec.x.label, (p.left + right) / 2, base + 31, "middle");
      const inside = make("g", { "clip-path": `url(#${p.prefix}clip)` }, p.live);
      for (const m of p.spec.marks) {
        const at = m.x === null ? p.y.pixel(m.y) : p.x.pixel(m.x);
        const ends = m.x === null ? { x1: p.left, x2: right, y1: at, y2: at } : { x1: at, x2: at, y1: p.top, y2: base };
        make("line", { class: "mark", ...ends }, inside);
      }
      for (const b of p.bands) {
        for (const run of this.runs(p, b.x, (i) => Number.isFinite(b.low[i]) && Number.isFinite(b.high[i]))) {
          const edges = [...this.points(p, b.x, b.high, run), ...this.points(p, b.x, b.low, run).reverse()];
          make("polygon", { points: edges.join(" "), fill: b.colour, "fill-opacity": 0.18 }, inside);
        }
      }
      for (const c of p.curves) this.curve(p, c, inside);
    }

    // Indices of the part within view and one point beyond it on either side, in runs between the gaps, where nothing is
    // known; a path in the plane is kept whole.
    runs(p, x, known, whole = false) {
      const out = [[]], last = x.length - 1;
      for (let i = 0; i <= last; i++) {
        const seen = whole || (x[Math.min(i + 1, last)] >= p.x.lim[0] && x[Math.max(i - 1, 0)] <= p.x.lim[1]);
        if (seen && known(i)) out.at(-1).push(i);
        else if (out.at(-1).length) out.push([]);
      }
      return out.filter((run) => run.length);
    }

    points(p, x, y, run) {
      return run.map((i) => `${p.x.pixel(x[i]).toFixed(1)},${p.y.pixel(y[i]).toFixed(1)}`);
    }

    curve(p, c, parent) {
      const style = { fill: "none", stroke: c.colour, "stroke-width": c.width };
      if (!c.marker) {
        const dashes = { "stroke-dasharray": c.dashed ? "8 4" : "none" };
        for (const run of this.runs(p, c.x, (i) => Number.isFinite(c.y[i]), c.along !== null || c.name === ""))
          make("polyline", { points: this.points(p, c.x, c.y, run).join(" "), ...style, ...dashes }, parent);
        return;
      }
      c.x.forEach((v, i) => {
        const x = p.x.pixel(v), y = p.y.pixel(c.y[i]);
        if (c.marker === "o") make("circle", { cx: x, cy: y, r: 3.5, ...style }, parent);
        else make("path", { d: `M${x - 3.5} ${y - 3.5}l7 7m0 -7l-7 7`, ...style }, parent);
      });
    }

    hover(event, panel, [px, py]) {
      this.clear();
      if (!panel) return;
      const rows = panel.curves.some((c) => c.marker || c.along) ? this.nearestPoint(panel, px, py) : this.crosshair(panel, px);
      if (rows.length === 0) return;
      this.readout.replaceChildren(...rows);
      this.readout.hidden = false;
      const area = this.figure.getBoundingClientRect();
      const x = event.clientX - area.left, left = x + 16 + this.readout.offsetWidth > area.width ? x - 16 - this.readout.offsetWidth : x + 16;
      this.readout.style.left = `${Math.max(0, left)}px`;
      this.readout.style.top = `${Math.max(0, event.clientY - area.top - this.readout.offsetHeight - 12)}px`;
    }

    row(colour, name, value) {
      const line = document.createElement("div"), swatch = document.createElement("i"), text = document.createElement("b");
      swatch.style.background = colour;
      text.textContent = value;
      line.append(swatch, name, text);
      return line;
    }

    // All curves of the hovered column at one x.
    crosshair(panel, px) {
      const value = panel.x.value(px), rows = [this.row("transparent", panel.spec.x.label, `${format(value)} ${panel.spec.x.unit}`)];
      for (const p of this.panels.filter((other) => other.spec.col === panel.spec.col)) {
        make("line", { class: "cross", x1: px, x2: px, y1: p.top, y2: p.top + p.height }, p.over);
        for (const c of p.curves) {
          const point = c.name === "" ? null : this.at(p, c, px);
          if (point === null) continue;
          const y = p.y.pixel(point.y);
          if (y >= p.top && y <= p.top + p.height) make("circle", { cx: p.x.pixel(point.x), cy: y, r: 3, fill: c.colour }, p.over);
          rows.push(this.row(c.colour, p.spec.title && p.spec.title !== c.name ? `${p.spec.title} ${c.name}` : c.name, p.y.say(point.y)));
        }
      }
      return rows;
    }

    // What is drawn of a curve at a pixel: the sample there, or the straight line between two that are far apart. Null
    // where nothing is: before its first sample, after its last, and in its gaps.
    at(p, c, px) {
      const near = 12, value = p.x.value(px), i = nearest(c.x, value), there = p.x.pixel(c.x[i]);
      if (Math.abs(there - px) <= near) {
        const outside = (i === 0 && there - px > 1) || (i === c.x.length - 1 && px - there > 1);
        return outside || !Number.isFinite(c.y[i]) ? null : { x: c.x[i], y: c.y[i] };
      }
      const j = there < px ? i + 1 : i - 1;
      if (j < 0 || j >= c.x.length || !Number.isFinite(c.y[i]) || !Number.isFinite(c.y[j])) return null;
      const share = (px - there) / (p.x.pixel(c.x[j]) - there), from = p.y.pixel(c.y[i]), to = p.y.pixel(c.y[j]);
      return { x: value, y: p.y.value(from + share * (to - from)) };
    }

    nearestPoint(p, px, py) {
      let best = null;
      for (const c of p.curves.filter((one) => one.name && (one.marker || one.along)))
        c.x.forEach((v, i) => {
          const x = p.x.pixel(v), y = p.y.pixel(c.y[i]), gap = Math.hypot(x - px, y - py);
          if (gap < 30 && (best === null || gap < best.gap)) best = { c, i, x, y, gap };
        });
      if (best === null) return [];
      make("circle", { class: "ring", cx: best.x, cy: best.y, r: 8 }, p.over);
      const sign = best.c.y[best.i] < 0 ? "−" : "+";
      const rows = [this.row(best.c.colour, best.c.name, `${format(best.c.x[best.i])} ${sign} ${format(Math.abs(best.c.y[best.i]))}j`)];
      if (best.c.along) rows.push(this.row("transparent", "frequency", `${format(best.c.along[best.i])} Hz`));
      return rows;
    }
  }

  const nearest = (xs, value) => {
    let low = 0, high = xs.length - 1;
    while (high - low > 1) { const mid = (low + high) >> 1; if (xs[mid] <= value) low = mid; else high = mid; }
    return value - xs[low] < xs[high] - value ? low : high;
  };

  for (const figure of document.querySelectorAll("figure.chart")) new Chart(figure);
  document.documentElement.classList.add("interactive");
})();
