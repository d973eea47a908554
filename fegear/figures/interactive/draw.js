(function () {
  // Draws a figure in every element of its class, once plotly.js is there.
  "use strict";
  const figure = FIGURE;
  const config = { responsive: true, displaylogo: false };

  function variant(place) {
    const meta = figure.layout.meta;
    return place.clientWidth < meta.breakpoint ? "narrow" : "wide";
  }

  function fit(place) {
    const next = variant(place);
    if (place.clientWidth > 0 && place.dataset.layout !== next) {
      place.dataset.layout = next;
      Plotly.relayout(place, figure.layout.meta[next]);
    }
  }

  // lines across a panel are not traces: plotly does not hide them with their entry
  function hideShapes(place) {
    const entries = place.data.filter((trace) => trace.showlegend);
    const hidden = entries.filter((trace) => trace.visible === "legendonly");
    const groups = new Set(hidden.map((trace) => trace.legendgroup));
    const changes = {};
    (place.layout.shapes || []).forEach((shape, index) => {
      const visible = !groups.has(shape.legendgroup);
      if (shape.legendgroup && (shape.visible !== false) !== visible) {
        changes[`shapes[${index}].visible`] = visible;
      }
    });
    if (Object.keys(changes).length) Plotly.relayout(place, changes);
  }

  function draw(place) {
    place.replaceChildren();
    place.dataset.layout = "wide";
    const { data, layout } = structuredClone(figure);
    Plotly.newPlot(place, data, layout, config).then(() => {
      fit(place);
      place.on("plotly_restyle", () => hideShapes(place));
      new ResizeObserver(() => fit(place)).observe(place);
    });
  }

  function drawAll() {
    if (!window.Plotly) {
      setTimeout(drawAll, 50);
      return;
    }
    document.querySelectorAll(".NAME:not([data-layout])").forEach(draw);
  }
  drawAll();
})();
