// A page's engine in Node: reads JSON, writes JSON.  Times are of the CPU, in ms.
import fs from "fs";
const { engine, module, facts, runs } = JSON.parse(fs.readFileSync(0));
const { engineOf } = new Function(`${fs.readFileSync(engine, "utf8")}; return { engineOf };`)();
const made = await engineOf(fs.readFileSync(module), facts);
const done = runs.map(({ given = {}, rtol, times = 1 }) => {
  let found, cpu;
  for (let k = 0; k < times; k++) {
    const from = process.cpuUsage();
    made.begin(given, rtol);
    while (!made.advance(1000));
    found = made.finish();
    const { user, system } = process.cpuUsage(from);
    cpu = (user + system) / 1000;
  }
  const outputs = Array.from({ length: facts.rows }, (_, row) => Array.from(found.column(row), String));
  return { ...found, column: undefined, events: Array.from(found.events), outputs, cpu };
});
process.stdout.write(JSON.stringify(done));
