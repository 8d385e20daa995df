#include "apps/pgo/outlier_report.hpp"

#include <algorithm>
#include <ostream>
#include <sstream>

#include "apps/team/text_table.hpp"
#include "modules/core/json_writer.hpp"
#include "modules/evaluation/curve_plot.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

// The seeds of one share and method.
struct Cell {
  std::span<const OutlierResult> results;

  [[nodiscard]] const OutlierResult& any() const { return results.front(); }

  [[nodiscard]] double median(auto OutlierResult::*member) const {
    std::vector<double> values;
    for (const OutlierResult& r : results) values.push_back(static_cast<double>(r.*member));
    return statistics_of(std::move(values)).median;
  }
  [[nodiscard]] std::size_t true_kept() const {
    return std::ranges::min(results, {}, &OutlierResult::true_kept).true_kept;
  }
  [[nodiscard]] std::size_t false_kept() const {
    return std::ranges::max(results, {}, &OutlierResult::false_kept).false_kept;
  }
  [[nodiscard]] bool decided() const {
    return std::ranges::all_of(results, &OutlierResult::decided);
  }
};

std::vector<Cell> cells_of(const OutlierStudy& study) {
  const std::span<const OutlierResult> all(study.results);
  std::vector<Cell> cells;
  for (std::size_t first = 0, k = 1; k <= all.size(); ++k)
    if (k == all.size() || all[k].method != all[first].method ||
        all[k].share_percent != all[first].share_percent) {
      cells.push_back({all.subspan(first, k - first)});
      first = k;
    }
  return cells;
}

// Of methods that find out; nothing if none did.
std::string noise_text(const OutlierStudy& study) {
  if (study.results.empty()) return {};
  const auto [least, most] = std::ranges::minmax(study.results, {}, &OutlierResult::noise_scale);
  if (least.noise_scale == 1.0 && most.noise_scale == 1.0) return {};
  const std::string from = rounded(least.noise_scale, 3);
  const std::string to = rounded(most.noise_scale, 3);
  return "closures found to be " + from + (to == from ? "" : " to " + to) +
         " times as noisy as the file says\n";
}

// A curve per method.
CurvePanel panel(const OutlierStudy& study, const std::string& title, const char* unit, bool log,
                 const auto& ordinate) {
  CurvePanel panel{
      .title = title,
      .x_label = "false closures per 100 true ones (" + std::to_string(study.true_closures) + ")",
      .y_label = unit,
      .log_y = log,
      .curves = {}};
  for (const Cell& cell : cells_of(study)) {
    const std::string& method = cell.any().method;
    auto curve = std::ranges::find(panel.curves, method, &Curve::name);
    if (curve == panel.curves.end())
      curve = panel.curves.insert(curve, {method, {}, panel.curves.size(), false, true});
    curve->points.push_back({cell.any().share_percent, static_cast<double>(ordinate(cell))});
  }
  return panel;
}

}  // namespace

std::string outlier_text(const OutlierStudy& study) {
  std::vector<std::vector<std::string>> rows{
      {"method", "share", "false", "true kept", "false kept", "rmse m", "rounds", "sent", "CPU s"}};
  bool decided = true;
  for (const Cell& cell : cells_of(study)) {
    decided = decided && cell.decided();
    rows.push_back({cell.any().method, rounded(cell.any().share_percent, 6) + " %",
                    std::to_string(cell.any().false_closures), std::to_string(cell.true_kept()),
                    std::to_string(cell.false_kept()),
                    rounded(cell.median(&OutlierResult::rmse_m), 2),
                    fixed(cell.median(&OutlierResult::rounds), 0) + (cell.decided() ? "" : "+"),
                    bytes_text(cell.median(&OutlierResult::bytes)),
                    fixed(cell.median(&OutlierResult::cpu_s), 2)});
  }
  std::ostringstream text;
  text << study.poses << " poses, " << study.true_closures << " true closures, " << study.robots
       << (study.robots == 1 ? " robot" : " robots") << "; translations of false closures within "
       << fixed(study.half_side_m, 1) << " m along every axis\n"
       << "rmse: of positions to the optimum of the graph without false closures, which is "
       << (study.certified ? "certified\n" : "NOT certified\n") << noise_text(study)
       << align_columns(rows) << (decided ? "" : "+: came to no end within --rounds\n");
  return text.str();
}

void write_outlier_json(std::ostream& out, const OutlierStudy& study) {
  JsonWriter json(out);
  json.begin_object();
  json.fields("poses", study.poses, "robots", study.robots, "true_closures", study.true_closures,
              "certified", study.certified, "half_side_m", study.half_side_m);
  json.objects("results", study.results, [&](const OutlierResult& r) {
    json.fields("method", r.method, "share_percent", r.share_percent, "seed", r.seed,
                "false_closures", r.false_closures, "true_kept", r.true_kept, "false_kept",
                r.false_kept, "noise_scale", r.noise_scale, "rmse_m", r.rmse_m, "rounds", r.rounds,
                "decided", r.decided, "bytes", r.bytes, "cpu_s", r.cpu_s);
  });
  json.end_object();
}

std::string outlier_plot(const OutlierStudy& study) {
  return plot_curves(
      std::vector{panel(study, "RMSE of positions to the optimum without false closures", "m", true,
                        [](const Cell& cell) { return cell.median(&OutlierResult::rmse_m); }),
                  panel(study, "True closures lost", "closures", false,
                        [&](const Cell& cell) { return study.true_closures - cell.true_kept(); }),
                  panel(study, "False closures kept", "closures", false,
                        [](const Cell& cell) { return cell.false_kept(); }),
                  panel(study, "CPU time of all robots", "s", false,
                        [](const Cell& cell) { return cell.median(&OutlierResult::cpu_s); })});
}

}  // namespace km
