/* What a reader of the report can do beyond reading: look at one layout of the front at a time, ask what is left
   within a budget and a target, and ask what other prices do. Every number comes from the page's data block, which
   holds what was simulated; nothing is computed but sums, comparisons and places on the figure. Without this script
   the page shows the same cards and tables one below the other. */
"use strict";
(() => {
  const find = (selector) => document.querySelector(selector);
  const findAll = (selector) => [...document.querySelectorAll(selector)];
  const source = document.getElementById("report-data");
  if (!source) return;
  const data = JSON.parse(source.textContent);
  const layouts = data.layouts;
  if (!layouts.length) return;

  const number = (value, digits) =>
    value.toLocaleString("en-GB", { minimumFractionDigits: digits, maximumFractionDigits: digits }).replaceAll(",", "\u202f");
  const euros = (value) => `${number(value, 2)}\u00a0EUR`;
  const errorText = (value) => `${value.toPrecision(3)}${data.unit === "°" ? "" : "\u00a0"}${data.unit}`;
  const counted = (count) => `${count} of ${layouts.length} layouts ${count === 1 ? "is" : "are"}`;

  document.documentElement.classList.add("scripted");
  findAll("[data-scripted]").forEach((element) => { element.hidden = false; });

  /* One card at a time. Pointing shows a card as long as the pointer stays; a click or Enter keeps it. */
  const cards = layouts.map((layout) => document.getElementById(layout.id));
  const marks = layouts.map((layout) => find(`a.mark[href="#${layout.id}"]`));
  let kept = Math.max(0, cards.findIndex((card) => card.dataset.first === "yes"));

  function show(index) {
    cards.forEach((card, place) => card.classList.toggle("shown", place === index));
    marks.forEach((mark, place) => mark?.classList.toggle("chosen", place === index));
  }

  function keep(index) {
    kept = index;
    // One stop for the Tab key in the figure; the arrow keys go from mark to mark.
    marks.forEach((mark, place) => mark?.setAttribute("tabindex", place === index ? "0" : "-1"));
    show(index);
  }

  function step(from, by) {
    for (let index = from + by; index >= 0 && index < marks.length; index += by) {
      if (marks[index]) return index;
    }
    return from;
  }

  const keys = {
    ArrowRight: (index) => step(index, 1),
    ArrowDown: (index) => step(index, 1),
    ArrowLeft: (index) => step(index, -1),
    ArrowUp: (index) => step(index, -1),
    Home: () => step(-1, 1),
    End: () => step(marks.length, -1),
  };

  marks.forEach((mark, index) => {
    if (!mark) return;
    mark.addEventListener("pointerenter", () => show(index));
    mark.addEventListener("pointerleave", () => show(kept));
    mark.addEventListener("focus", () => keep(index));
    mark.addEventListener("click", (event) => {
      event.preventDefault();
      keep(index);
      cards[index].querySelector("h3").focus();
    });
    mark.addEventListener("keydown", (event) => {
      const move = keys[event.key];
      if (!move) return;
      event.preventDefault();
      marks[move(index)]?.focus();
    });
  });
  cards.forEach((card, index) => card.addEventListener("keydown", (event) => {
    if (event.key === "Escape") marks[index]?.focus();
  }));
  // Links of tables lead to a card that may not be the one shown.
  findAll('a[href^="#layout-"]:not(.mark)').forEach((link) => link.addEventListener("click", () => {
    keep(layouts.findIndex((layout) => `#${layout.id}` === link.getAttribute("href")));
  }));
  const asked = layouts.findIndex((layout) => `#${layout.id}` === location.hash);
  keep(asked >= 0 ? asked : kept);

  /* What is wider than its box is scrolled by keys too, and named after its section. */
  function reach() {
    findAll(".wide, .drawing").forEach((box) => {
      const cut = box.scrollWidth > box.clientWidth;
      box.toggleAttribute("tabindex", cut);
      if (cut) box.tabIndex = 0;
      if (box.matches(".wide")) {
        box.toggleAttribute("role", cut);
        box.toggleAttribute("aria-label", cut);
        if (cut) {
          box.setAttribute("role", "region");
          box.setAttribute("aria-label", `Table: ${box.closest("section").querySelector("h2").textContent}`);
        }
      }
    });
  }
  window.addEventListener("resize", reach);
  reach();

  /* Budget and target. The right end of a slider means that there is no limit. */
  const budget = find("#budget");
  const target = find("#target");

  function prepare(slider, values, padded) {
    const low = Math.min(...values);
    const high = Math.max(...values);
    // A hundred steps of a round size, so that people hit numbers they can say.
    const rough = Math.max((high - low) / 100, high / 1000, Number.MIN_VALUE);
    const size = 10 ** Math.floor(Math.log10(rough));
    const pace = [1, 2, 5, 10].map((factor) => factor * size).find((value) => value >= rough);
    slider.step = "any";
    slider.min = Math.floor(low / pace - padded) * pace;
    slider.max = Math.ceil(high / pace + 1) * pace;
    slider.step = pace;
    slider.value = slider.max;
  }

  const limitOf = (slider) => (Number(slider.value) >= Number(slider.max) ? Infinity : Number(slider.value));

  function placeOn(axis, value) {
    const scale = axis.logarithmic ? Math.log : (plain) => plain;
    const share = (scale(value) - scale(axis.low)) / (scale(axis.high) - scale(axis.low));
    return share >= 0 && share <= 1 ? axis.start + share * (axis.end - axis.start) : null;
  }

  function drawLimit(id, axis, attributes, value) {
    const line = document.getElementById(id);
    if (!line) return;
    const place = Number.isFinite(value) ? placeOn(axis, value) : null;
    line.toggleAttribute("hidden", place === null);
    attributes.forEach((name) => line.setAttribute(name, place ?? 0));
  }

  function say(slider, text) {
    document.getElementById(`${slider.id}-value`).textContent = text;
    slider.setAttribute("aria-valuetext", text);
  }

  const bound = (layout) => layout.bound ?? Infinity;
  const cheapestOf = (items, cost) => items.reduce((best, item) => (best && cost(best) <= cost(item) ? best : item), null);

  function choose() {
    const most = limitOf(budget);
    const worst = limitOf(target);
    const left = layouts.filter((layout) => layout.cost <= most && (worst === Infinity || bound(layout) <= worst));
    layouts.forEach((layout, index) => {
      const out = !left.includes(layout);
      marks[index]?.classList.toggle("out", out);
      cards[index].classList.toggle("out", out);
      findAll(`tr[data-layout="${layout.id}"]`).forEach((row) => row.classList.toggle("out", out));
    });
    say(budget, most === Infinity ? "no limit" : `at most ${euros(most)}`);
    say(target, worst === Infinity ? "no limit" : `at most ${errorText(worst)}`);
    if (data.axes) {
      drawLimit("budget-line", data.axes.x, ["x1", "x2"], most);
      drawLimit("target-line", data.axes.y, ["y1", "y2"], worst);
    }
    const best = cheapestOf(left, (layout) => layout.cost);
    find("#cheapest").textContent = best
      ? `${counted(left.length)} left. The cheapest: ${best.label}, ${euros(best.cost)}, ${data.goal} `
        + `${best.bound === null ? "with a bound that is not known" : `at most ${errorText(best.bound)} with 95 % confidence`}.`
      : "No layout on this page is left. Others were not simulated enough to be named here.";
  }

  if (budget && target) {
    prepare(budget, layouts.map((layout) => layout.cost), 1);
    const ends = layouts.flatMap((layout) => [layout.error, layout.bound]).filter((value) => value !== null);
    prepare(target, ends.length ? ends : [1], 1);
    [budget, target].forEach((slider) => slider.addEventListener("input", choose));
    choose();
  }

  /* Prices. Quantities do not depend on prices, so a bill is summed anew line by line: quantity times price, rounded
     half up to whole cents as the bill itself is. */
  const prices = findAll("input[data-kind]");

  function cents(layout, scales) {
    // The small part outweighs binary fractions: 0.1 times 5 cents is half a cent, and not less.
    return layout.lines.reduce(
      (sum, [kind, quantity, price]) => sum + Math.floor(quantity * price * (scales[kind] ?? 1) * 100 + 0.5 + 1e-7), 0);
  }

  function reprice() {
    const scales = {};
    prices.forEach((slider) => {
      scales[slider.dataset.kind] = Number(slider.value) / 100;
      say(slider, `${slider.value} % of the list`);
    });
    const costs = new Map(layouts.map((layout) => [layout, cents(layout, scales) / 100]));
    const beaten = (layout) => layouts.some((other) => other !== layout
      && costs.get(other) <= costs.get(layout) && other.error <= layout.error
      && (costs.get(other) < costs.get(layout) || other.error < layout.error));
    layouts.forEach((layout) => {
      const row = find(`#prices tr[data-layout="${layout.id}"]`);
      row.querySelector(".new-cost").textContent = euros(costs.get(layout));
      row.querySelector(".still").textContent = layout.error === null ? "not known" : beaten(layout) ? "beaten" : "unbeaten";
    });
    const best = cheapestOf(layouts, (layout) => costs.get(layout));
    find("#repriced").textContent = `At these prices the cheapest of these layouts is ${best.label}, ${euros(costs.get(best))}; `
      + `${counted(layouts.filter((layout) => layout.error !== null && !beaten(layout)).length)} unbeaten in cost and mean error.`;
  }

  if (prices.length) {
    prices.forEach((slider) => slider.addEventListener("input", reprice));
    find("#list-prices").addEventListener("click", () => {
      prices.forEach((slider) => { slider.value = 100; });
      reprice();
    });
    reprice();
  }
})();
