// Tables that are wider than their page scroll by themselves: with the keyboard, too.
function reachable() {
  for (const table of document.querySelectorAll(".bd-article table")) {
    if (table.scrollWidth > table.clientWidth) table.tabIndex = 0;
    else table.removeAttribute("tabindex");
  }
}
addEventListener("load", () => {
  reachable();
  // what opens the pages below another is called by that one's name
  for (const summary of document.querySelectorAll("summary:has(.toctree-toggle)")) {
    const link = summary.closest("li")?.querySelector("a");
    if (link) summary.setAttribute("aria-label", `below ${link.textContent.trim()}`);
  }
  // where its own words are seen, they are its name
  for (const button of document.querySelectorAll(".search-button__button")) {
    if (button.innerText.trim()) button.removeAttribute("aria-label");
  }
});
addEventListener("resize", reachable);
