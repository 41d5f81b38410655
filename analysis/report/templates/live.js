// Sliders, figures and requirements of a loop that runs in this page.
const SVG = "http://www.w3.org/2000/svg";
const COARSE = 1e-6; // relative tolerance while a slider is being moved
const SLICE = 10; // ms of work between two looks at what the reader does
const LONGEST = 20000; // ms of work for one run
const draw = (tag, attributes, parent, text) => {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  parent?.append(element);
  return element;
};
const put = (tag, name, parent, text = "") => {
  const element = make(tag, text, parent);
  if (name) element.className = name;
  return element;
};
const digits = (value, count = 6) => {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "NaN" : value > 0 ? "∞" : "−∞";
  return String(Number(value.toPrecision(count))).replace("-", "−");
};
// What a field shows that nobody writes in: digits that fit. The value itself is kept.
const brief = (value) => String(Number(value.toPrecision(6)));
const endsOf = (values) => {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return [low, high];
};
const stepOf = (span) => {
  const size = 10 ** Math.floor(Math.log10(span / 4));
  return size * ([1, 2, 2.5, 5, 10].find((each) => each * size >= span / 5) ?? 10);
};
const ticksOf = ([low, high]) => {
  const step = stepOf(high - low);
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, k) => (first + k) * step);
};

// The level of the heading under which an element stands.
const levelAbove = (element) => {
  const before = [...document.querySelectorAll("h1, h2, h3, h4, h5")]
    .filter((each) => each.compareDocumentPosition(element) & Node.DOCUMENT_POSITION_FOLLOWING);
  return Number(before.at(-1)?.tagName[1] ?? 1);
};

// Margins of requirements over time; positive where they hold.
const least = (t, values, start, end, until) => {
  const found = new Float64Array(t.length).fill(Infinity);
  const waiting = []; // places whose values rise
  let next = 0;
  for (let k = 0, head = 0; k < t.length; k++) {
    while (next < t.length && t[next] <= Math.min(t[k] + end, until) + 1e-9) {
      while (waiting.length > head && !(values[waiting.at(-1)] < values[next])) waiting.pop();
      waiting.push(next++);
    }
    while (head < waiting.length && t[waiting[head]] < t[k] + start - 1e-9) head++;
    if (head < waiting.length) found[k] = values[waiting[head]];
  }
  return found;
};
const marginOf = ([kind, ...parts], t, signal, until) => {
  const inner = (part) => marginOf(part, t, signal, until);
  if (kind === "band") {
    const [name, low, high, scale] = parts;
    return signal(name).map((y) => Math.min(high - y, y - low) / scale);
  }
  if (kind === "not") return inner(parts[0]).map((m) => -m);
  if (kind === "and") return parts.map(inner).reduce((a, b) => a.map((m, k) => Math.min(m, b[k])));
  if (kind === "always") return least(t, inner(parts[0]), parts[1], parts[2], until);
  return least(t, inner(parts[0]).map((m) => -m), parts[1], parts[2], until).map((m) => -m);
};
const fallOf = (formula, t, signal, until) => {
  const [kind, part, start, end] = formula;
  if (kind === "and") return Math.min(...formula.slice(1).map((each) => fallOf(each, t, signal, until)));
  if (kind !== "always") return Infinity;
  const m = marginOf(part, t, signal, until);
  const k = m.findIndex((value, i) => t[i] >= start - 1e-9 && t[i] <= Math.min(end, until) + 1e-9 && !(value > 0));
  if (k < 0) return Infinity;
  if (k === 0 || t[k - 1] < start) return t[k];
  return t[k - 1] + ((t[k] - t[k - 1]) * m[k - 1]) / (m[k - 1] - m[k]);
};

// A curve in as many points as can be told apart.
const pathOf = (t, y, across, along) => {
  const width = Math.max(1, Math.ceil(t.length / 900));
  let text = "", pen = "M";
  const point = (k) => {
    if (!Number.isFinite(y[k])) return void (pen = "M");
    text += `${pen}${across(t[k]).toFixed(1)} ${along(y[k]).toFixed(1)}`;
    pen = "L";
  };
  for (let k = 0; k < t.length; k += width) {
    let [low, high] = [k, k];
    for (let i = k; i < Math.min(k + width, t.length); i++) {
      if (y[i] < y[low]) low = i;
      if (y[i] > y[high]) high = i;
    }
    point(Math.min(low, high));
    if (low !== high) point(Math.max(low, high));
  }
  if (t.length) point(t.length - 1);
  return text;
};

const rangeOf = (curves, reported, limits, bands) => {
  const finite = (lists, inside = () => true) => {
    let [low, high] = [Infinity, -Infinity];
    for (const values of lists) {
      for (const value of values) {
        if (!Number.isFinite(value) || !inside(value)) continue;
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    return [low, high];
  };
  const base = finite([...reported, ...bands]);
  const size = base[1] - base[0] || Math.abs(base[0]) || 1;
  const near = (value) => value > base[0] - 8 * size && value < base[1] + 8 * size;
  let [low, high] = finite([...curves, base], near);
  if (!(low <= high)) [low, high] = [-1, 1];
  for (const [value] of limits) {
    if (value > low - size && value < high + size) [low, high] = [Math.min(low, value), Math.max(high, value)];
  }
  const pad = 0.05 * (high - low || 1);
  return [low - pad, high + pad];
};

// One of the modules of a page, which are packed in turn, piece by piece.
const moduleOf = async ({ data, of, sizes, piece, place }) => {
  const other = of && JSON.parse(document.querySelector(`#${CSS.escape(of)} > script`).textContent);
  const content = await unpacked(data ?? other.module.data);
  const module = new Uint8Array(sizes[place]);
  for (let at = 0, from = 0; at < Math.max(...sizes); at += piece) {
    sizes.forEach((size, k) => {
      const count = Math.min(Math.max(size - at, 0), piece);
      if (k === place) module.set(content.subarray(from, from + count), at);
      from += count;
    });
  }
  return module;
};

class LivePart {
  constructor(figure) {
    this.figure = figure;
    this.content = JSON.parse(figure.querySelector("script").textContent);
    this.values = this.content.handles.map((handle) => handle.value);
    this.on = this.content.handles.map((handle) => Boolean(handle.is_on));
    this.turn = 0;
  }

  async begin() {
    const { module, facts } = this.content;
    this.engine = await engineOf(await moduleOf(module), facts);
    this.figure.hidden = false;
    this.build();
    await this.run();
    this.reported = this.last;
    this.show();
    new ResizeObserver(() => this.show()).observe(this.view);
    matchMedia("print").addEventListener("change", () => this.show());
  }

  build() {
    const { figure, content } = this;
    const caption = figure.querySelector("figcaption");
    const body = put("div", "", null);
    caption.before(body);
    const heading = put(`h${levelAbove(figure) + 1}`, "heading", body, "Move it");
    heading.id = `${figure.id}-heading`;
    figure.setAttribute("aria-labelledby", heading.id);
    const knobs = put("form", "knobs", body);
    knobs.addEventListener("submit", (event) => event.preventDefault());
    this.knobs = content.handles.map((handle, k) => this.knob(handle, k, knobs));
    const tools = put("div", "tools", body);
    this.reset = put("button", "", tools, content.origin[0].toUpperCase() + content.origin.slice(1));
    this.reset.addEventListener("click", () => {
      this.values = content.handles.map((handle) => handle.value);
      this.on = content.handles.map((handle) => Boolean(handle.is_on));
      this.changed();
    });
    put("button", "", tools, "Copy the command").addEventListener("click", () => this.copy());
    this.said = put("p", "said", tools);
    this.said.setAttribute("role", "status");
    if (content.requirements.length) this.verdicts = put("ul", "verdicts", body);
    this.view = put("div", "view", body);
    const details = put("details", "", body);
    put("summary", "", details, "Numbers of this run, and the command that repeats it");
    const scroll = put("div", "scroll", details);
    scroll.tabIndex = 0;
    scroll.setAttribute("role", "group");
    scroll.setAttribute("aria-label", "Outputs of this run");
    this.table = put("table", "live-numbers", scroll);
    const pre = put("pre", "", details);
    pre.tabIndex = 0;
    pre.setAttribute("role", "group");
    pre.setAttribute("aria-label", "command that repeats this run");
    this.command = put("code", "", pre);
    for (const each of [...tools.querySelectorAll("button")]) each.type = "button";
    this.mark();
  }

  knob(handle, k, parent) {
    const box = put("div", "knob", parent);
    const label = put("label", "", box);
    const id = `${this.figure.id}-knob-${k}`;
    let toggle;
    if (handle.fault) {
      toggle = put("input", "", label);
      toggle.type = "checkbox";
      put("span", "", label, `${handle.fault} begins at`);
      toggle.addEventListener("change", () => {
        this.on[k] = toggle.checked;
        this.changed();
      });
    } else put("span", "", label, handle.name);
    if (handle.unit) put("span", "unit", label, ` (${handle.unit})`);
    if (handle.meaning && !handle.fault) box.title = handle.meaning;
    const slider = put("input", "", box);
    Object.assign(slider, { type: "range", min: handle.low, max: handle.high, step: (handle.high - handle.low) / 200 });
    slider.id = `${id}-slider`;
    label.htmlFor = toggle ? `${id}-switch` : slider.id;
    if (toggle) {
      toggle.id = label.htmlFor;
      slider.setAttribute("aria-label", handle.name);
    }
    const field = put("input", "", box);
    Object.assign(field, { type: "number", step: "any", id });
    field.setAttribute("aria-label", `${handle.name}, exact value`);
    field.addEventListener("focus", () => {
      field.value = this.values[k];
      field.select(); // as it was before the value was another one
    });
    field.addEventListener("blur", () => { field.value = brief(this.values[k]); });
    const set = (value, still) => {
      if (!Number.isFinite(value)) return;
      this.values[k] = value;
      if (handle.fault) this.on[k] = true;
      this.changed(still);
    };
    slider.addEventListener("input", () => set(Number(Number(slider.value).toPrecision(6)), false));
    slider.addEventListener("change", () => this.changed(true));
    field.addEventListener("change", () => {
      const value = Math.min(Math.max(Number(field.value), handle.low), handle.high);
      set(field.value === "" ? handle.value : value, true);
    });
    return { toggle, slider, field, label };
  }

  isMoved(k) {
    const handle = this.content.handles[k];
    if (handle.fault) return this.on[k] !== Boolean(handle.is_on) || (this.on[k] && this.values[k] !== handle.value);
    return this.values[k] !== handle.value;
  }

  // Show the values, and what of them differs from those reported.
  mark() {
    this.content.handles.forEach((handle, k) => {
      const { toggle, slider, field, label } = this.knobs[k];
      if (toggle) toggle.checked = this.on[k];
      slider.value = this.values[k];
      slider.setAttribute("aria-valuetext", `${digits(this.values[k])} ${handle.unit ?? ""}`.trim());
      field.title = this.values[k];
      if (document.activeElement !== field) field.value = brief(this.values[k]);
      label.classList.toggle("moved", this.isMoved(k));
    });
    this.reset.disabled = !this.values.some((_, k) => this.isMoved(k));
    this.command.textContent = this.text();
  }

  given() {
    const given = { p: [], x: [], u: [] };
    this.content.handles.forEach((handle, k) => {
      if (!this.isMoved(k)) return;
      const value = handle.fault && !this.on[k] ? this.content.never : this.values[k];
      given[handle.kind].push([handle.place, value, handle.name]);
    });
    return given;
  }

  text() {
    const { command } = this.content;
    const { p, x, u } = this.given();
    if (command.shell) {
      const quoted = (word) => (/^[\w.=:/+-]+$/.test(word) ? word : `'${word}'`);
      const set = [...p, ...x].map(([, value, name]) => ` --set ${quoted(`${name}=${value}`)}`);
      const inputs = u.map(([, value, name]) => ` --input ${quoted(`${name}=${value}`)}`);
      return command.shell + set.join("") + inputs.join("");
    }
    const pairs = (base, moved) => {
      const all = { ...base };
      for (const [, value, name] of moved) all[name.replace(/\(0\)$/, "")] = value;
      return Object.entries(all).map(([name, value]) => `"${name}": ${value}`).join(", ");
    };
    const inputs = command.inputs.map((value, k) => value ?? (command.inputs.length > 1 ? `u[${k}]` : "u"));
    for (const [place, value] of u) inputs[place] = value;
    const parts = [command.python, command.times];
    const [params, states] = [pairs(command.params, p), pairs(command.states, x)];
    if (inputs.some((value) => value !== 0)) parts.push(inputs.length > 1 ? `[${inputs.join(", ")}]` : inputs[0]);
    if (states) parts.push(`initial_state={${states}}`);
    if (params) parts.push(`params={${params}}`);
    return `nlctl.input_output_response(${parts.join(", ")})`;
  }

  async copy() {
    const text = this.text();
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const field = put("textarea", "", this.figure, text);
      field.select();
      document.execCommand("copy");
      field.remove();
    }
    this.say(`Copied: ${text}`);
  }

  say(text, bad = false) {
    this.said.textContent = text;
    this.said.classList.toggle("bad", bad);
  }

  changed(still = true) {
    this.mark();
    const tolerance = still ? undefined : Math.max(COARSE, this.content.facts.rtol);
    this.run(tolerance).catch((error) => this.say(error.message, true));
  }

  // Run in slices, so that the page answers meanwhile; what is moved in between begins anew.
  async run(rtol) {
    const turn = ++this.turn;
    const { engine } = this;
    const given = this.given();
    let work = 0, over = false;
    engine.begin(given, rtol);
    while (!over && work < LONGEST) {
      const from = performance.now();
      while (!over && performance.now() - from < SLICE) over = engine.advance(100);
      work += performance.now() - from;
      if (!over) await new Promise((resolve) => setTimeout(resolve));
      if (turn !== this.turn) return;
    }
    const from = performance.now();
    this.last = { ...engine.finish(), given };
    this.last.signals = Object.fromEntries(
      this.content.outputs.map((name, row) => [name, this.last.column(row)]));
    work += performance.now() - from;
    this.last.work = work;
    this.show();
    if (rtol !== undefined) return;
    const { t, steps, events, ends } = this.last;
    const reason = over ? ends : "it takes too long";
    const told = `${steps} steps, ${events.length} ${events.length === 1 ? "event" : "events"}, ${Math.round(work)} ms`;
    this.say(reason ? `The run ends at t = ${digits(t, 5)} s: ${reason}. ${told}.` : `${digits(t, 5)} s in ${told}.`, Boolean(reason));
  }

  show() {
    if (!this.last || !this.view) return;
    const falls = this.judge();
    this.view.replaceChildren(...this.content.rows.map((row, k) => this.row(row, k, falls)));
    this.numbers();
  }

  judge() {
    const { last, engine, content } = this;
    const t = engine.times.subarray(0, last.done);
    const falls = [];
    const lines = content.requirements.map((each) => {
      const line = put("li", "");
      const signal = (name) => last.signals[name];
      const short = t.length < 2 || t.at(-1) < each.until * (1 - 1e-12);
      const until = Math.min(each.until, t.at(-1) ?? 0);
      const margin = short ? -Infinity : marginOf(each.formula, t, signal, each.until)[0];
      const holds = margin > 0;
      const at = holds ? Infinity : Math.min(fallOf(each.formula, t, signal, until), until);
      const badge = put("b", holds ? "pass" : "fail", line, holds ? "holds" : `falls at ${digits(at, 4)} s`);
      badge.after(` ${each.key}: ${each.text}${each.meaning ? ` (${each.meaning})` : ""}`);
      line.dataset.at = at;
      line.dataset.margin = margin;
      if (!holds) falls.push({ at, text: JSON.stringify(each.formula), key: each.key });
      return line;
    });
    this.verdicts?.replaceChildren(...lines);
    return falls;
  }

  row({ title, names }, k, falls) {
    const { content, engine, last, reported } = this;
    const isLast = k === content.rows.length - 1;
    const width = Math.max(this.view.clientWidth - 12, 240);
    const many = names.length > 1;
    const shown = names.slice(0, 4);
    const labels = many ? this.labels(shown, 54, width) : [];
    const lines = labels.length ? labels.at(-1).line + 1 : 0;
    const [left, right, top, bottom] = [54, 8, 10 + 16 * lines, isLast ? 38 : 22];
    const height = top + bottom + (content.rows.length > 1 ? 122 : 190);
    const t = engine.times.subarray(0, last.done);
    const before = reported?.given && reported !== last ? shown.map((name) => reported.signals[name]) : [];
    const curves = shown.map((name) => last.signals[name]);
    const limits = shown.flatMap((name) => content.limits[name] ?? []);
    const bands = shown.map((name) => content.bands[name]).filter(Boolean);
    const y = rangeOf(curves, before.length ? before : curves, limits, bands.flatMap(([, low, high]) => [low, high]));
    const span = [content.facts.begin, content.facts.end];
    const across = (value) => left + ((value - span[0]) / (span[1] - span[0])) * (width - left - right);
    const along = (value) => {
      const place = top + (1 - (value - y[0]) / (y[1] - y[0])) * (height - top - bottom);
      return Math.min(Math.max(place, top - 3), height - bottom + 3);
    };
    const told = shown.map((name, i) => {
      const [least, largest] = endsOf(curves[i]);
      return `${name} between ${digits(least, 4)} and ${digits(largest, 4)}`;
    });
    const svg = draw("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${title}: ${told.join("; ")}` });
    for (const value of ticksOf(span)) {
      draw("path", { class: "grid", d: `M${across(value)} ${top}V${height - bottom}` }, svg);
      draw("text", { x: across(value), y: height - bottom + 15, "text-anchor": "middle" }, svg, digits(value, 4));
    }
    for (const value of ticksOf(y)) {
      draw("path", { class: "grid", d: `M${left} ${along(value)}H${width - right}` }, svg);
      draw("text", { x: left - 6, y: along(value) + 4, "text-anchor": "end" }, svg, digits(value, 4));
    }
    draw("path", { class: "frame", d: `M${left} ${top}V${height - bottom}H${width - right}` }, svg);
    const label = many ? title : shown[0];
    draw("text", { transform: `translate(11 ${(top + height - bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, svg, label.length > 22 ? `${label.slice(0, 20)}…` : label);
    if (isLast) draw("text", { x: (left + width - right) / 2, y: height - 4, "text-anchor": "middle" }, svg, "time t (s)");
    for (const [times, low, high] of bands) {
      const there = times.map((at, i) => `${across(at).toFixed(1)} ${along(high[i]).toFixed(1)}`);
      const back = times.map((at, i) => `${across(at).toFixed(1)} ${along(low[i]).toFixed(1)}`).reverse();
      draw("path", { class: "band", d: `M${[...there, ...back].join("L")}Z` }, svg);
    }
    for (const [value, start, end] of limits) {
      if (value < y[0] || value > y[1]) continue;
      draw("path", { class: "limit", d: `M${across(Math.max(start, span[0]))} ${along(value)}H${across(Math.min(end, span[1]))}` }, svg);
    }
    before.forEach((curve) => {
      draw("path", { class: "as-reported", d: pathOf(engine.times.subarray(0, curve.length), curve, across, along) }, svg);
    });
    curves.forEach((curve, i) => draw("path", { class: `curve curve-${i}`, d: pathOf(t, curve, across, along) }, svg));
    content.handles.forEach((handle, i) => {
      if (handle.fault && this.on[i] && this.values[i] > span[0] && this.values[i] < span[1]) {
        draw("path", { class: "begins", d: `M${across(this.values[i])} ${top}V${height - bottom}` }, svg);
      }
    });
    for (const fall of falls) {
      if (!shown.some((name) => fall.text.includes(JSON.stringify(name)))) continue;
      const place = across(Math.min(Math.max(fall.at, span[0]), span[1]));
      draw("path", { class: "falls", d: `M${place} ${top}V${height - bottom}` }, svg);
      const side = place > width / 2;
      draw("text", { class: "falls-at", x: place + (side ? -4 : 4), y: top + 12, "text-anchor": side ? "end" : "start" }, svg, `${fall.key} ✗`);
    }
    labels.forEach(({ x, line, word }, i) => {
      draw("path", { class: `curve curve-${i}`, d: `M${x} ${10 + 16 * line}h22` }, svg);
      draw("text", { x: x + 27, y: 14 + 16 * line }, svg, word);
    });
    return svg;
  }

  // Where the names of curves stand, in as many lines as they need.
  labels(names, left, width) {
    let [x, line] = [left, 0];
    return names.map((name) => {
      const word = name.length > 18 ? `${name.slice(0, 17)}…` : name;
      const size = 41 + 7 * word.length;
      if (x + size > width && x > left) [x, line] = [left, line + 1];
      const place = { x, line, word };
      x += size;
      return place;
    });
  }

  numbers() {
    const rows = this.content.outputs.map((name) => {
      const curve = this.last.signals[name];
      const values = [...endsOf(curve), curve.at(-1) ?? NaN];
      const row = put("tr", "");
      make("th", name, row).scope = "row";
      for (const value of values) put("td", "number", row, digits(value)).dataset.value = value;
      return row;
    });
    const head = put("tr", "");
    for (const title of ["output", "least", "largest", "at the end"]) {
      const cell = put("th", title === "output" ? "" : "number", head, title);
      cell.scope = "col";
    }
    this.table.replaceChildren(head, ...rows);
  }
}

for (const figure of document.querySelectorAll("figure.live")) {
  const part = new LivePart(figure);
  part.begin().catch((error) => {
    figure.hidden = false;
    put("p", "said bad", figure, `The loop does not run in this browser: ${error.message}`);
  });
  figure.loop = part; // for whoever looks on: what runs, and what it has found
}
