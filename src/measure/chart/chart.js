// A plot keeps the width it was drawn with: fit it to the paper, with all tables open, and back.
const plots = () => document.querySelectorAll(".plot .js-plotly-plot");
const tables = () => document.querySelectorAll("details");
addEventListener("beforeprint", () => {
  tables().forEach((table) => { table.open = true; });
  plots().forEach((plot) => Plotly.relayout(plot, { width: 680 }));
});
addEventListener("afterprint", () => {
  tables().forEach((table) => { table.open = false; });
  plots().forEach((plot) => Plotly.relayout(plot, { width: null, autosize: true }));
});
