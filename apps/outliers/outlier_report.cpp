#include "apps/outliers/outlier_report.hpp"

#include <algorithm>
#include <functional>
#include <iomanip>
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
  Rejection method = Rejection::kNone;
  double share_percent = 0.0;
  std::vector<OutlierResult> results;

  [[nodiscard]] double median(const std::function<double(const OutlierResult&)>& of) const {
    std::vector<double> values;
    for (const OutlierResult& result : results) values.push_back(of(result));
    return statistics_of(values).median;
  }
  [[nodiscard]] std::size_t true_kept() const {
    return std::min_element(results.begin(), results.end(),
                            [](const auto& a, const auto& b) { return a.true_kept < b.true_kept; })
        ->true_kept;
  }
  [[nodiscard]] std::size_t false_kept() const {
    return std::max_element(
               results.begin(), results.end(),
               [](const auto& a, const auto& b) { return a.false_kept < b.false_kept; })
        ->false_kept;
  }
  [[nodiscard]] bool decided() const {
    return std::all_of(results.begin(), results.end(), [](const auto& r) { return r.decided; });
  }
  [[nodiscard]] double rmse_m() const {
    return median([](const OutlierResult& r) { return r.rmse_m; });
  }
  [[nodiscard]] double rounds() const {
    return median([](const OutlierResult& r) { return static_cast<double>(r.rounds); });
  }
  [[nodiscard]] double bytes() const {
    return median([](const OutlierResult& r) { return static_cast<double>(r.bytes); });
  }
  [[nodiscard]] double cpu_s() const {
    return median([](const OutlierResult& r) { return r.cpu_s; });
  }
};

std::vector<Cell> cells_of(const OutlierStudy& study) {
  std::vector<Cell> cells;
  for (const OutlierResult& result : study.results) {
    const auto found = std::find_if(cells.begin(), cells.end(), [&](const Cell& cell) {
      return cell.method == result.method && cell.share_percent == result.share_percent;
    });
    if (found != cells.end())
      found->results.push_back(result);
    else
      cells.push_back({result.method, result.share_percent, {result}});
  }
  return cells;
}

// So many of them that count.
std::string digits(double value, int count) {
  std::ostringstream text;
  text << std::setprecision(count) << value;
  return text.str();
}

// With the decimals it has: "30 %", "2.5 %".
std::string percent_text(double percent) {
  std::ostringstream text;
  text << percent << " %";
  return text.str();
}

// What the sigmas of all runs were multiplied by; nothing if by 1.
std::string noise_text(const OutlierStudy& study) {
  const auto [least, most] = std::minmax_element(
      study.results.begin(), study.results.end(),
      [](const auto& a, const auto& b) { return a.noise_scale < b.noise_scale; });
  if (least == study.results.end() || (least->noise_scale == 1.0 && most->noise_scale == 1.0))
    return {};
  const std::string from = digits(least->noise_scale, 3);
  const std::string to = digits(most->noise_scale, 3);
  return "closures taken to be " + from + (to == from ? "" : " to " + to) +
         " times as noisy as the file says\n";
}

std::vector<std::string> row(const Cell& cell) {
  return {to_string(cell.method),
          percent_text(cell.share_percent),
          std::to_string(cell.results.front().false_closures),
          std::to_string(cell.true_kept()),
          std::to_string(cell.false_kept()),
          digits(cell.rmse_m(), 2),
          fixed(cell.rounds(), 0) + (cell.decided() ? "" : "+"),
          bytes_text(cell.bytes()),
          fixed(cell.cpu_s(), 2)};
}

// A curve per method.
CurvePanel panel(const OutlierStudy& study, const std::vector<Cell>& cells, const char* title,
                 const char* unit, bool log, const std::function<double(const Cell&)>& ordinate) {
  CurvePanel panel{
      .title = title,
      .x_label = "false closures per 100 true ones (" + std::to_string(study.true_closures) + ")",
      .y_label = unit,
      .log_y = log,
      .curves = {}};
  std::vector<Rejection> methods;
  for (const Cell& cell : cells) {
    auto found = std::find(methods.begin(), methods.end(), cell.method);
    if (found == methods.end()) {
      panel.curves.push_back({to_string(cell.method), {}, methods.size(), false, true});
      found = methods.insert(methods.end(), cell.method);
    }
    panel.curves[static_cast<std::size_t>(found - methods.begin())].points.push_back(
        {cell.share_percent, ordinate(cell)});
  }
  return panel;
}

}  // namespace

std::string outlier_text(const OutlierStudy& study) {
  std::vector<std::vector<std::string>> rows{
      {"method", "share", "false", "true kept", "false kept", "rmse m", "rounds", "sent", "CPU s"}};
  const std::vector<Cell> cells = cells_of(study);
  for (const Cell& cell : cells) rows.push_back(row(cell));
  std::ostringstream text;
  text << study.poses << " poses, " << study.true_closures << " true closures, " << study.robots
       << (study.robots == 1 ? " robot" : " robots") << "; translations of false closures within "
       << fixed(study.half_side_m, 1) << " m along every axis\n"
       << "rmse: of positions to the optimum of the graph without false closures, which is "
       << (study.certified ? "certified\n" : "NOT certified\n") << noise_text(study)
       << align_columns(rows);
  const auto undecided = [](const Cell& cell) { return !cell.decided(); };
  if (std::any_of(cells.begin(), cells.end(), undecided))
    text << "+: came to no end within --rounds\n";
  return text.str();
}

void write_outlier_json(std::ostream& out, const OutlierStudy& study) {
  JsonWriter json(out);
  json.begin_object();
  json.field("poses", study.poses);
  json.field("robots", study.robots);
  json.field("true_closures", study.true_closures);
  json.field("certified", study.certified);
  json.field("half_side_m", study.half_side_m);
  json.key("results");
  json.begin_array();
  for (const OutlierResult& result : study.results) {
    json.begin_object();
    json.field("method", to_string(result.method));
    json.field("share_percent", result.share_percent);
    json.field("seed", result.seed);
    json.field("false_closures", result.false_closures);
    json.field("true_kept", result.true_kept);
    json.field("false_kept", result.false_kept);
    json.field("noise_scale", result.noise_scale);
    json.field("rmse_m", result.rmse_m);
    json.field("rounds", result.rounds);
    json.field("decided", result.decided);
    json.field("bytes", result.bytes);
    json.field("cpu_s", result.cpu_s);
    json.end_object();
  }
  json.end_array();
  json.end_object();
}

std::string outlier_plot(const OutlierStudy& study) {
  const std::vector<Cell> cells = cells_of(study);
  const auto lost = [&](const Cell& cell) {
    return static_cast<double>(study.true_closures - cell.true_kept());
  };
  return plot_curves(
      std::vector{panel(study, cells, "RMSE of positions to the optimum without false closures",
                        "m", true, &Cell::rmse_m),
                  panel(study, cells, "True closures lost", "closures", false, lost),
                  panel(study, cells, "False closures kept", "closures", false,
                        [](const Cell& cell) { return static_cast<double>(cell.false_kept()); }),
                  panel(study, cells, "CPU time of all robots", "s", false, &Cell::cpu_s)});
}

}  // namespace km
