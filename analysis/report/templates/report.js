// Without this script everything is readable; with it tables sort and filter, figures enlarge.
// A cell's number if it has one, else its text; numbers first, NaN and empty cells last.
const keyOf = (row, column) => {
  const cell = row.cells[column];
  const value = cell?.dataset.value;
  return value === undefined ? (cell?.textContent.trim() ?? "") : Number(value);
};
const isLast = (key) => key === "" || Number.isNaN(key);
const compare = (a, b, direction) => {
  if (isLast(a) || isLast(b)) return isLast(a) - isLast(b);
  if (typeof a !== typeof b) return typeof a === "number" ? -1 : 1;
  if (typeof a === "number") return direction * (a < b ? -1 : a > b ? 1 : 0);
  return direction * a.localeCompare(b, "en", { numeric: true });
};

for (const table of document.querySelectorAll("table.data")) {
  const body = table.tBodies[0];
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    if (body.rows.length < 3 || head.className === "plain") return;
    const button = make("button", "");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const direction = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", direction === 1 ? "ascending" : "descending");
      const rows = [...body.rows].map((row) => [keyOf(row, column), row]);
      rows.sort((a, b) => compare(a[0], b[0], direction));
      body.append(...rows.map(([, row]) => row));
    });
  });
  if (table.classList.contains("many")) {
    const bar = make("div", "");
    bar.className = "filter";
    const input = make("input", "", make("label", "Filter rows", bar));
    input.type = "search";
    const count = make("span", "", bar);
    count.setAttribute("role", "status");
    table.parentElement.before(bar);
    input.addEventListener("input", () => {
      const words = input.value.toLowerCase().replaceAll("\u2212", "-").split(/\s+/).filter(Boolean);
      const rows = [...body.rows];
      for (const row of rows) {
        const text = row.textContent.toLowerCase().replaceAll("\u2212", "-");
        row.hidden = !words.every((word) => text.includes(word));
      }
      const left = rows.filter((row) => !row.hidden).length;
      count.textContent = words.length ? `${left} of ${rows.length} rows` : "";
    });
  }
}

// What is folded opens for a link to it or into it, and for paper.
const unfold = () => {
  let element = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!element?.closest("details:not([open])")) return;
  for (let at = element; (at = at.closest("details")); at = at.parentElement) at.open = true;
  element.scrollIntoView();
};
unfold();
window.addEventListener("hashchange", unfold);
document.addEventListener("click", (event) => {
  if (event.target.closest?.('a[href^="#"]')) setTimeout(unfold); // also where the hash stays
});
let opened = [];
window.addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details:not([open])")];
  for (const details of opened) details.open = true;
});
window.addEventListener("afterprint", () => {
  for (const details of opened) details.open = false;
});
const folds = [...document.querySelectorAll("details")];
const contents = document.getElementById("contents");
if (folds.length && contents) {
  const button = make("button", "Unfold all", contents);
  button.className = "unfold";
  contents.prepend(button); // the list may be longer than the screen
  button.addEventListener("click", () => {
    const open = folds.some((details) => !details.open);
    for (const details of folds) details.open = open;
    button.textContent = open ? "Fold all" : "Unfold all";
  });
}

const dialog = make("dialog", "", document.body);
dialog.setAttribute("aria-label", "Enlarged figure");
const close = make("button", "Close", dialog);
close.addEventListener("click", () => dialog.close());
let home = null;
const enlarge = (drawing) => {
  if (home) return;
  home = drawing.parentElement;
  const caption = make("p", "", dialog);
  const copy = home.querySelector("figcaption").cloneNode(true);
  copy.querySelector("button").remove();
  caption.append(...copy.childNodes);
  dialog.insertBefore(drawing, caption);
  dialog.showModal();
};
dialog.addEventListener("close", () => {
  home.prepend(dialog.querySelector(".drawing"));
  dialog.querySelector("p").remove();
  home = null;
});
for (const drawing of document.querySelectorAll("figure > .drawing")) {
  const figure = drawing.parentElement;
  const button = make("button", "Enlarge", figure.querySelector("figcaption"));
  button.setAttribute("aria-label", `Enlarge figure ${figure.id}`);
  button.addEventListener("click", () => enlarge(drawing));
  drawing.addEventListener("click", () => enlarge(drawing));
}
