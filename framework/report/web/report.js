// Draws the plots of a report. The data comes from the element #report-data (see plots.cpp); what
// went wrong is left in data-errors of the body, and data-plots counts what was drawn.
(() => {
  "use strict";

  const GRID = "#e6e9ed";
  const LINE = "#8a939c";
  const TEXT = "#1c2024";
  // From learned to not: light enough for dark text in every cell.
  const HEAT_COLOURS = [[0, "#6f9fd0"], [0.35, "#a9c6de"], [0.7, "#e3e5cf"], [1, "#fdf0b4"]];
  const BAND_OPACITY = 0.16;
  const MANY_COLUMNS = 40;  // of a heat map: no gaps between them, and not every one is named

  function note_error(message) {
    const before = document.body.dataset.errors;
    document.body.dataset.errors = before ? `${before}; ${message}` : message;
  }

  window.addEventListener("error", (event) => note_error(event.message));
  window.addEventListener("unhandledrejection", (event) => note_error(String(event.reason)));
  document.addEventListener("securitypolicyviolation",
                            (event) => note_error(`blocked ${event.violatedDirective}`));

  // Plotly reads a subset of HTML in its texts; ours are plain.
  function plain(text) {
    return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
  }

  // Places on an axis may be names.
  function names_plain(values) {
    return values.map((value) => typeof value === "string" ? plain(value) : value);
  }

  function translucent(colour, alpha) {
    const part = (at) => parseInt(colour.slice(at, at + 2), 16);
    return `rgba(${part(1)}, ${part(3)}, ${part(5)}, ${alpha})`;
  }

  // A band is two curves without a line, the area between them filled.
  function band_traces(series) {
    const edge = {
      type: "scatter", mode: "lines", x: names_plain(series.x), legendgroup: plain(series.group),
      line: {width: 0}, hoverinfo: "skip", showlegend: false,
    };
    return [
      {...edge, y: series.y_low},
      {...edge, y: series.y_high, fill: "tonexty",
       fillcolor: translucent(series.colour, BAND_OPACITY * series.opacity)},
    ];
  }

  function has_area(series) {
    return series.y_low !== undefined && series.draw.startsWith("lines");
  }

  // From the value up and down; what is not finite has none.
  function error_bars(series) {
    const from_value = (ends, sign) =>
      ends.map((end, i) => end === null || series.y[i] === null ? 0 : sign * (end - series.y[i]));
    return {
      type: "data", symmetric: false, thickness: 1.2, width: 3,
      color: series.draw === "bars" ? TEXT : series.colour,
      array: from_value(series.y_high, 1), arrayminus: from_value(series.y_low, -1),
    };
  }

  function curve_trace(series, show_in_legend) {
    const trace = {
      name: plain(series.name), x: names_plain(series.x), y: series.y, opacity: series.opacity,
      legendgroup: plain(series.group), showlegend: show_in_legend,
      legendrank: series.reference ? 1 : 1000,
    };
    if (series.draw === "bars") {
      Object.assign(trace, {type: "bar", marker: {color: series.colour}});
    } else {
      Object.assign(trace, {
        type: "scatter", mode: series.draw,
        line: {color: series.colour, dash: series.dash, width: series.width},
        marker: {color: series.colour, size: 6},
      });
    }
    if (series.y_low && !has_area(series)) trace.error_y = error_bars(series);
    return trace;
  }

  function series_traces(all_series) {
    const listed = new Set();
    const bands = [];
    const curves = [];
    for (const series of all_series) {
      const key = JSON.stringify([series.group, series.name]);
      if (has_area(series)) bands.push(...band_traces(series));
      curves.push(curve_trace(series, !listed.has(key)));
      listed.add(key);
    }
    // The reference is drawn last, or a good estimate would hide it, but is first in the legend.
    const is_reference = (curve, i) => all_series[i].reference;
    const traces = [...bands, ...curves.filter((curve, i) => !is_reference(curve, i)),
                    ...curves.filter(is_reference)];
    return {traces, legend_entries: listed.size};
  }

  function heat_map_trace(map) {
    const trace = {
      type: "heatmap", x: map.x.map(plain), y: map.y.map(plain), z: map.z,
      colorscale: HEAT_COLOURS, xgap: map.x.length > MANY_COLUMNS ? 0 : 2, ygap: 2, hoverongaps: false,
      colorbar: {title: {text: plain(map.colour_label), side: "right", font: {size: 13}},
                 thickness: 14, outlinewidth: 0},
    };
    if (map.z_min !== undefined) trace.zmin = map.z_min;
    if (map.z_max !== undefined) trace.zmax = map.z_max;
    // Plotly wants both ends or none.
    if ((map.z_min === undefined) !== (map.z_max === undefined)) {
      const values = map.z.flat().filter((value) => value !== null);
      trace.zmin ??= Math.min(...values);
      trace.zmax ??= Math.max(...values);
    }
    if (map.text) {
      trace.text = map.text.map((row) => row.map(plain));
      trace.texttemplate = "%{text}";
    }
    return trace;
  }

  function axis(label) {
    return {
      title: {text: plain(label), standoff: 10, font: {size: 13}}, automargin: true,
      gridcolor: GRID, zeroline: false,
      linecolor: LINE, ticks: "outside", tickcolor: LINE, ticklen: 4,
      showline: true, exponentformat: "power",
    };
  }

  function line_shape(line) {
    const across = line.axis === "y" ? "x" : "y";
    return {
      type: "line", layer: "above",
      [`${line.axis}0`]: line.value, [`${line.axis}1`]: line.value,
      [`${across}ref`]: "paper", [`${across}0`]: 0, [`${across}1`]: 1,
      line: {color: "#444444", width: 1.2, dash: line.dash},
    };
  }

  function line_label(line, log_y) {
    const horizontal = line.axis === "y";
    const value = horizontal && log_y ? Math.log10(line.value) : line.value;
    return {
      text: plain(line.label), showarrow: false, font: {size: 12, color: "#444444"},
      bgcolor: "rgba(255, 255, 255, 0.75)", borderpad: 1,
      ...(horizontal ? {xref: "paper", x: 1, xanchor: "right", y: value, yanchor: "bottom"}
                     : {yref: "paper", y: 1, yanchor: "top", x: value, xanchor: "left"}),
    };
  }

  // Tics of an axis that has few powers of ten to show.
  function one_two_five() {
    const exponents = Array.from({length: 25}, (_, i) => i - 12);
    return exponents.flatMap((k) => [1, 2, 5].map((digit) => Number(`${digit}e${k}`)));
  }

  // How many powers of ten an axis has to show.
  function decades_of(plot) {
    const across = plot.lines.filter((line) => line.axis === "y").map((line) => line.value);
    const curves = plot.series.flatMap((series) => series.y);
    const shown = plot.y_range ?? [...curves, ...across].filter((value) => value > 0);
    const logs = shown.map(Math.log10);
    const most = logs.reduce((a, b) => Math.max(a, b), -Infinity);
    return most - logs.reduce((a, b) => Math.min(a, b), Infinity);
  }

  function layout_of(plot, legend_entries) {
    const layout = {
      font: {family: getComputedStyle(document.body).fontFamily, size: 13, color: TEXT},
      paper_bgcolor: "#ffffff", plot_bgcolor: "#ffffff",
      // On top the tool bar, below it the legend.
      margin: {l: 60, r: 16, t: legend_entries > 1 ? 56 : 34, b: 48},
      height: plot.height_px || (plot.equal_axes ? 560 : 400),
      xaxis: {...axis(plot.x_label), nticks: 8}, yaxis: axis(plot.y_label),
      hovermode: "closest", barmode: "group", bargap: 0.25,
      showlegend: legend_entries > 1,
      legend: {orientation: "h", x: 0, xanchor: "left", y: 1.02, yanchor: "bottom",
               tracegroupgap: 0, groupclick: "togglegroup"},
      shapes: plot.lines.map(line_shape),
      annotations: plot.lines.filter((line) => line.label !== "")
                       .map((line) => line_label(line, plot.log_y)),
    };
    if (plot.equal_axes) Object.assign(layout.yaxis, {scaleanchor: "x", scaleratio: 1});
    if (plot.series.some((series) => typeof series.x[0] === "string")) {
      layout.xaxis.type = "category";
      delete layout.xaxis.nticks;
    }
    if (plot.log_y) {
      Object.assign(layout.yaxis, {type: "log"},
                    decades_of(plot) > 2 ? {dtick: 1} : {tickvals: one_two_five()});
    }
    if (plot.y_range) {
      layout.yaxis.range = plot.log_y ? plot.y_range.map(Math.log10) : plot.y_range;
    }
    if (plot.heat_map) {
      const bare = {showgrid: false, showline: false, ticks: "", type: "category"};
      Object.assign(layout.xaxis, bare);
      Object.assign(layout.yaxis, bare, {autorange: "reversed"});
      if (plot.heat_map.x.length > MANY_COLUMNS) {
        Object.assign(layout.xaxis, {nticks: 14, tickangle: 0});
      } else {
        delete layout.xaxis.nticks;
      }
      if (!plot.height_px) {
        const row = plot.heat_map.text ? 34 : 22;
        layout.height = 120 + row * Math.max(plot.heat_map.y.length, 4);
      }
    }
    return layout;
  }

  function draw(figure, plot) {
    const {traces, legend_entries} = series_traces(plot.series);
    if (plot.heat_map) traces.unshift(heat_map_trace(plot.heat_map));
    const canvas = figure.querySelector(".canvas");
    return Plotly.newPlot(canvas, traces, layout_of(plot, legend_entries), {
      responsive: true, displaylogo: false,
      modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d", "zoomIn2d", "zoomOut2d"],
      toImageButtonOptions: {format: "svg", filename: "plot"},
    });
  }

  // One broken plot does not take the others with it.
  async function draw_all() {
    const {plots} = JSON.parse(document.getElementById("report-data").textContent);
    let drawn = 0;
    for (const figure of document.querySelectorAll("figure.plot")) {
      try {
        await draw(figure, plots[Number(figure.dataset.plot)]);
        ++drawn;
      } catch (error) {
        note_error(String(error));
        const message = document.createElement("p");
        message.className = "warning failed";
        message.textContent = `This plot could not be drawn: ${error}`;
        figure.querySelector(".canvas").replaceChildren(message);
      }
    }
    document.body.dataset.plots = String(drawn);
  }

  document.addEventListener("DOMContentLoaded", draw_all);
})();
