"use strict";
// Tables are sorted by their headings, by click or keyboard; numbers by value, the rest by letters.
(() => {
  const valueOf = (row, column) => {
    const text = row.cells[column].textContent.trim();
    const found = text.replace(/,(?=\d{3})/g, "").replace("−", "-").match(/^[<(]?\s*(-?\d+(\.\d+)?)/);
    return { text, number: found ? Number(found[1]) : NaN };
  };
  const compare = (one, other, numeric) => {
    if (!numeric) return one.text.localeCompare(other.text, "en");
    const gap = Number.isNaN(one.number) - Number.isNaN(other.number);
    return gap || (Number.isNaN(one.number) ? 0 : one.number - other.number);
  };
  const sort = (table, heading, column) => {
    const down = heading.getAttribute("aria-sort") === "ascending";
    const numeric = heading.classList.contains("number");
    const body = table.tBodies[0];
    const rows = [...body.rows].filter(row => !row.classList.contains("summary"));
    const last = [...body.rows].filter(row => row.classList.contains("summary"));
    const keyed = rows.map(row => ({ row, value: valueOf(row, column) }));
    keyed.sort((a, b) => (down ? -1 : 1) * compare(a.value, b.value, numeric));
    table.querySelectorAll("th[aria-sort]").forEach(each => each.removeAttribute("aria-sort"));
    heading.setAttribute("aria-sort", down ? "descending" : "ascending");
    body.append(...keyed.map(each => each.row), ...last);
  };
  document.querySelectorAll("figure.table table").forEach(table => {
    [...table.tHead.rows[0].cells].forEach((heading, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...heading.childNodes);
      heading.append(button);
      button.addEventListener("click", () => sort(table, heading, column));
    });
  });
  // A wide table or figure says that it goes on, at the side where it does.
  const cue = box => {
    box.classList.toggle("more-right", box.scrollLeft + box.clientWidth < box.scrollWidth - 1);
    box.classList.toggle("more-left", box.scrollLeft > 1);
  };
  const boxes = [...document.querySelectorAll(".scroll")];
  const watch = new ResizeObserver(changed => changed.forEach(each => cue(each.target)));
  boxes.forEach(box => { box.addEventListener("scroll", () => cue(box)); watch.observe(box); });
  // Paper shows what is folded on the screen.
  let closed = [];
  addEventListener("beforeprint", () => {
    closed = [...document.querySelectorAll("details:not([open])")];
    document.querySelectorAll("img[loading]").forEach(image => { image.loading = "eager"; });
    closed.forEach(each => { each.open = true; });
  });
  addEventListener("afterprint", () => closed.forEach(each => { each.open = false; }));
})();
