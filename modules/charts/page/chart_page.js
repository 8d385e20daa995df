// Shows the plot in #plot, see chart_page.hpp. Follows charts.js in one module.

const {title, series} = JSON.parse(document.getElementById('plot').textContent);
mapChart(element('div', 'plot', document.getElementById('charts')), {title, height: 560})
    .set(series.map(
        (one) => ({
          ...one,
          color: one.colour === null ? GREY : robotColor(one.colour),
          points: one.points.map((p) => p.map((n) => n ?? NaN))
        })));
document.body.dataset.ready = 'true';
