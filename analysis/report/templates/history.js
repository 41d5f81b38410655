// Interactive time histories.  What they show stands in figures beside them as well.
const COLOURS = 6; // of history.css
const STYLES = [["solid", []], ["dashed", [9, 4]], ["dashed", [9, 3, 2, 3]], ["dotted", [2, 3]]];
const styleOf = (i) => STYLES[i % STYLES.length];
const colour = (name) => getComputedStyle(document.body).getPropertyValue(name).trim();
const short = (value) => String(Number(value.toPrecision(6))).replaceAll("-", "−");
const field = (parent) => {
  const element = make("span", "", parent);
  element.className = "value";
  return element;
};
const charts = [];

for (const figure of document.querySelectorAll("figure.history")) {
  const { names, shown, unit, data } = JSON.parse(figure.querySelector("script").textContent);
  const [time] = data;
  const box = figure.querySelector(".plot");
  figure.hidden = false;

  const bar = make("div", "");
  bar.className = "signals";
  const values = names.map((name, i) => {
    const button = make("button", "", bar);
    button.setAttribute("aria-pressed", shown[i]);
    make("i", "", button).style.borderTopColor = `var(--curve-${i % COLOURS})`;
    button.firstChild.style.borderTopStyle = styleOf(i)[0];
    make("span", name, button);
    button.addEventListener("click", () => {
      const show = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", show);
      chart.setSeries(i + 1, { show });
    });
    return field(button);
  });
  const tools = make("div", "");
  tools.className = "tools";
  const label = make("label", "Time", tools);
  const slider = make("input", "", label);
  Object.assign(slider, { type: "range", min: 0, max: time.length - 1, value: 0 });
  const now = field(label);
  box.after(bar, tools);

  // Values at a sample, beside the names and for those who only hear the slider.
  const tell = (place) => {
    const texts = data.map((row) => (row[place] === null ? "no value" : short(row[place])));
    values.forEach((value, i) => (value.textContent = texts[i + 1]));
    now.textContent = `${texts[0]} s`;
    slider.value = place;
    const drawn = names.map((name, i) => chart.series[i + 1].show && `${name} ${texts[i + 1]}`);
    slider.setAttribute("aria-valuetext", [now.textContent, ...drawn.filter(Boolean)].join(", "));
  };
  const look = (min, max) => chart.setScale("x", { min, max });
  slider.addEventListener("input", () => {
    const place = Number(slider.value);
    chart.setCursor({ left: chart.valToPos(time[place], "x"), top: 0 });
    tell(place);
  });
  const zoom = make("button", "Zoom in", tools);
  zoom.addEventListener("click", () => {
    const { min, max } = chart.scales.x;
    const middle = Math.min(Math.max(time[slider.value], min), max);
    look(Math.max(min, middle - (max - min) / 4), Math.min(max, middle + (max - min) / 4));
  });
  make("button", "Reset zoom", tools).addEventListener("click", () => look(time[0], time.at(-1)));

  const axis = {
    stroke: () => colour("--soft"),
    grid: { stroke: () => colour("--line"), width: 1 },
    ticks: { stroke: () => colour("--line"), width: 1 },
    font: "12px system-ui, sans-serif",
    labelFont: "12px system-ui, sans-serif",
    labelSize: 20,
    values: (_, ticks) => ticks.map(short),
  };
  const options = {
    width: box.clientWidth,
    height: 320,
    scales: { x: { time: false } },
    legend: { show: false },
    axes: [
      { ...axis, size: 34, label: "time t (s)" },
      { ...axis, size: 64, ...(unit && { label: unit }) },
    ],
    series: [{}, ...names.map((name, i) => ({
      label: name,
      show: shown[i],
      stroke: () => colour(`--curve-${i % COLOURS}`),
      width: 1.5,
      pxAlign: 0,
      dash: styleOf(i)[1],
      points: { show: false },
    }))],
    hooks: { setCursor: [({ cursor }) => cursor.idx != null && tell(cursor.idx)] },
  };
  const chart = new uPlot(options, data, box);
  tell(0);
  charts.push(chart);
  new ResizeObserver(() => chart.setSize({ width: box.clientWidth, height: 320 })).observe(box);
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  charts.forEach((chart) => chart.redraw());
});
