(function () {
  // Draws a figure in every element of its class, once plotly.js is there.
  "use strict";
  const figure = FIGURE;
  const config = { responsive: true, displaylogo: false };

  // the layout with what differs by width, from attributes by their paths
  function layoutOf(kind) {
    const layout = structuredClone(figure.layout);
    Object.entries(figure.layout.meta[kind]).forEach(([path, value]) => {
      const keys = path.replace(/\[(\d+)\]/g, ".$1").split(".");
      const last = keys.pop();
      const part = keys.reduce((node, key) => (node[key] ??= {}), layout);
      part[last] = value;
    });
    return layout;
  }

  function fit(place) {
    const kind =
      place.clientWidth < figure.layout.meta.breakpoint ? "narrow" : "wide";
    if (place.clientWidth === 0 || place.dataset.layout === kind) return;
    place.dataset.layout = kind;
    // drawn anew: margins of legends that were elsewhere would remain
    Plotly.newPlot(place, structuredClone(figure.data), layoutOf(kind), config);
    place.on("plotly_restyle", () => hideShapes(place));
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
    place.dataset.layout = "";
    new ResizeObserver(() => fit(place)).observe(place);
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
