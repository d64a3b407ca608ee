"use strict";
(() => {
  const plots = [...document.querySelectorAll(".plot")];
  const touch = window.matchMedia("(pointer: coarse)").matches;
  const config = {
    responsive: true,
    displaylogo: false,
    modeBarButtons: [["zoom2d", "pan2d"], ["zoomIn2d", "zoomOut2d", "autoScale2d", "resetScale2d"], ["toImage"]],
    toImageButtonOptions: { scale: 2, filename: document.title },
  };
  // On a phone a finger on a figure scrolls the page; the zoom button changes that.
  if (touch) config.modeBarButtons = [["zoom2d", "autoScale2d", "resetScale2d"]];

  let moving = false;
  function follow(source, change) {
    if (moving) return;
    let range = null;
    for (const [key, value] of Object.entries(change)) {
      const part = /^xaxis\d*\.range(?:\[(\d)\])?$/.exec(key);
      if (!part) continue;
      if (part[1] === undefined) range = [...value];
      else (range ??= [])[Number(part[1])] = value;
    }
    if (!range || range[0] === undefined || range[1] === undefined) return;
    moving = true;
    const others = plots.filter((plot) => plot !== source && "timed" in plot.dataset);
    Promise.all(others.map((plot) => Plotly.relayout(plot, { "xaxis.range": range }))).finally(() => (moving = false));
  }

  const drawn = plots.map((plot) => {
    const { data, layout } = JSON.parse(plot.nextElementSibling.textContent);
    layout.dragmode = touch ? false : "zoom";
    if ("timed" in plot.dataset) {
      for (const key of Object.keys(layout)) {
        if (/^xaxis\d*$/.test(key)) layout[key].unifiedhovertitle = { text: `t = %{x:${layout[key].hoverformat}} s` };
      }
    }
    return Plotly.newPlot(plot, data, layout, config).then(() => {
      if ("timed" in plot.dataset) plot.on("plotly_relayout", (change) => follow(plot, change));
    });
  });
  Promise.all(drawn).then(() => document.documentElement.setAttribute("data-drawn", plots.length));

  // Paper is narrower than most windows: drawn to its width, then back to the window's.
  const PAPER = 690; // px, within A4 and Letter
  window.addEventListener("beforeprint", () => plots.forEach((plot) => Plotly.relayout(plot, { width: PAPER, autosize: false })));
  window.addEventListener("afterprint", () => plots.forEach((plot) => Plotly.relayout(plot, { width: null, autosize: true })));
})();
