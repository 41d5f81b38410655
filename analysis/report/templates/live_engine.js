// A loop that runs in this page: the integrators and the equations in WebAssembly, the same code
// that was run and compared where the page was made.  Nothing here touches the page.
const RUNNING = -1;
const ENDS = ["", "diverged", "too many steps", "steps too short", "", "", "resets without end"];
const unpacked = async (text) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
};

const evenly = (begin, end, count) => {
  const step = (end - begin) / (count - 1);
  const values = Float64Array.from({ length: count }, (_, k) => k * step + begin);
  values[count - 1] = end;
  return values;
};

const engineOf = async (bytes, facts) => {
  const provided = { fmod: (x, y) => x % y };
  for (const name of Object.getOwnPropertyNames(Math)) {
    if (typeof Math[name] === "function") provided[name] = Math[name];
  }
  const { instance } = await WebAssembly.instantiate(bytes, { env: provided });
  const code = instance.exports;
  const memory = code.memory.buffer;
  const fresh = new Uint8Array(memory).slice();
  const at = (name) => code[name]?.value;
  const numbers = (name, count) => new Float64Array(memory, at(name) ?? 0, count);
  const p = numbers("live.p", facts.parameters);
  const x = numbers("work.x", facts.states);
  const nominal = { p: p.slice(), x: x.slice(), u: numbers("task.inputs", facts.inputs * facts.times).slice() };
  const lane = new DataView(memory, at("work.lanes"));
  const whole = (name) => lane.getInt32(facts.lane[name], true);
  const times = facts.even
    ? evenly(facts.begin, facts.end, facts.times)
    : numbers("task.times", facts.times).slice();
  const setTolerance = (name, value) =>
    new DataView(memory, at("task")).setFloat64(facts.table[name], value, true);

  // Functions of time alone: when their conditions switch, and how far a step may lead.
  const known = { key: null, jumps: null, reach: null, longest: 0 };
  const s = numbers("live.s", facts.values);
  const atTime = (t) => {
    numbers("live.t", 1)[0] = t;
    code.live_timed();
  };
  const levels = (t) => {
    atTime(t);
    return s.slice(0, facts.levels);
  };
  const switched = (fastest) => {
    const waves = (fastest * (facts.end - facts.begin)) / (2 * Math.PI);
    const grid = evenly(facts.begin, facts.end, Math.min(Math.max(8192, Math.ceil(32 * waves)), 2e5) + 1);
    const found = new Map();  // the first time behind a switch: the last before it
    let before = levels(grid[0]);
    for (let k = 1; k < grid.length; k++) {
      const now = levels(grid[k]);
      for (let i = 0; i < facts.levels; i++) {
        if (now[i] === before[i]) continue;
        let [low, high] = [grid[k - 1], grid[k]];
        for (let middle = (low + high) / 2; middle > low && middle < high; middle = (low + high) / 2) {
          if (levels(middle)[i] === before[i]) low = middle;
          else high = middle;
        }
        if (high > facts.begin) found.set(high, low);
      }
      before = now;
    }
    const united = [];  // those that meet, as of t < 1 and t <= 1, are one
    for (const [behind, last] of [...found].sort((a, b) => a[0] - b[0])) {
      const one = united.at(-1);
      if (one && last <= one[0]) one[0] = behind;
      else united.push([behind, last]);
    }
    return united;
  };
  const reached = () => {
    const limit = new Float64Array(facts.cells).fill(Infinity);
    const t = evenly(facts.begin, facts.end, facts.cells + 1);
    const rows = facts.pulses.flatMap(([from, to]) => Array.from({ length: to - from }, (_, k) => from + k));
    const values = rows.map(() => new Float64Array(t.length));
    t.forEach((time, k) => {
      atTime(time);
      rows.forEach((row, i) => (values[i][k] = Number.isFinite(s[row]) ? s[row] : 0));
    });
    for (const row of values) {
      const [low, high] = row.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
      if (high - low <= 1e-12 * Math.max(Math.abs(low), Math.abs(high))) continue;
      const moved = new Float64Array(row.length);
      for (let k = 1; k < row.length; k++) moved[k] = moved[k - 1] + Math.abs(row[k] - row[k - 1]);
      for (let k = 0, to = 0; k < facts.cells; k++) {
        while (to < row.length && moved[to] < moved[k] + 0.5 * (high - low)) to++;
        if (to < row.length) limit[k] = Math.min(limit[k], t[to]);
      }
    }
    return limit;
  };
  const ofTime = () => {
    const key = p.join();
    if (known.key !== key) {
      code.live_timed_prepare();
      atTime(facts.begin);
      const speed = (wave) =>
        wave.reduce((sum, [from, to]) => sum + s.slice(from, to).reduce((a, v) => Math.max(a, Math.abs(v)), 0), 0);
      const fastest = facts.waves.map(speed).filter(Number.isFinite).reduce((a, b) => Math.max(a, b), 0);
      known.key = key;
      known.longest = fastest ? Math.PI / fastest : Infinity;
      known.jumps = facts.jumps ? switched(fastest).slice(0, facts.jumps) : [];
      known.reach = facts.cells ? reached() : [];
    }
    numbers("task.timed.longest", 1)[0] = known.longest;
    if (facts.jumps) {
      numbers("task.timed.jumps", facts.jumps).fill(Infinity).set(known.jumps.map(([behind]) => behind));
      numbers("task.timed.until", facts.jumps).fill(Infinity).set(known.jumps.map(([, before]) => before));
    }
    if (facts.cells) numbers("task.timed.reach", facts.cells).set(known.reach);
  };

  // Begin a run; `given` has the places and values of parameters, states and inputs.
  const begin = (given, rtol) => {
    new Uint8Array(memory).set(fresh);
    p.set(nominal.p);
    x.set(nominal.x);
    for (const [place, value] of given.p ?? []) p[place] = value;
    for (const [place, value] of given.x ?? []) x[place] = value;
    for (const [place, value] of given.u ?? []) {
      numbers("task.inputs", facts.inputs * facts.times).fill(value, place * facts.times, (place + 1) * facts.times);
    }
    if (facts.even) numbers("task.times", facts.times).set(times);
    setTolerance("rtol", rtol ?? facts.rtol);
    setTolerance("atol", rtol === undefined ? facts.atol : (rtol * facts.atol) / facts.rtol);
    code.live_prepare();
    ofTime();
    code.live_start();
    numbers("work.samples", facts.states).set(x);
  };
  // Try so many steps; return whether the run is over.
  const advance = (rounds) => {
    const before = whole("accepted") + whole("rejected");
    const told = code.live_advance(rounds);
    if (told !== 0 && told !== -2) throw new Error("the memory of the page does not suffice");
    return whole("status") !== RUNNING || whole("accepted") + whole("rejected") === before;
  };
  const finish = () => {
    code.live_outputs();
    const status = whole("status");
    const t = lane.getFloat64(facts.lane.t, true);
    const done = status === 0 ? facts.times : times.filter((each) => each <= t).length;
    const y = numbers("work.y", facts.times * facts.rows);
    const column = (row) => Float64Array.from({ length: done }, (_, k) => y[k * facts.rows + row]);
    const noted = Math.min(whole("noted"), facts.log);
    const when = numbers("work.log.t", facts.log ? noted : 0).slice();
    const ends = status === 0 ? "" : status === RUNNING ? "too many events" : ENDS[status] || "ended";
    return { t, done, ends, column, steps: whole("accepted"), tried: whole("rejected"), events: when };
  };
  return { begin, advance, finish, times, nominal };
};
