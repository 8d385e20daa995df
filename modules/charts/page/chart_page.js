// Shows the plots in #plots in the elements that they name, see chart_page.hpp. Follows charts.js
// in one module.

for (const [id, plots] of Object.entries(JSON.parse(document.getElementById('plots').textContent)))
  for (const plot of plots) plotChart(element('div', 'plot', document.getElementById(id)), plot);
document.body.dataset.ready = 'true';
