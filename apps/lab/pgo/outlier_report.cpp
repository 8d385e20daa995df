#include "apps/lab/pgo/outlier_report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <sstream>

#include "modules/core/json.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

// Results of all seeds for one share of false closures and one method.
using Cell = std::span<const OutlierResult>;

std::vector<Cell> cells_of(const OutlierStudy& study) {
  const Cell all(study.results);
  std::vector<Cell> cells;
  for (std::size_t first = 0, k = 1; k <= all.size(); ++k)
    if (k == all.size() || all[k].method != all[first].method ||
        all[k].share_percent != all[first].share_percent) {
      cells.push_back(all.subspan(first, k - first));
      first = k;
    }
  return cells;
}

Statistics statistics(Cell cell, auto OutlierResult::*member) {
  std::vector<double> values;
  for (const OutlierResult& r : cell) values.push_back(static_cast<double>(r.*member));
  return statistics_of(std::move(values));
}

std::optional<double> ratio_of(const OutlierStudy& study, const OutlierResult& result) {
  const auto reference = std::ranges::find_if(study.results, [&](const OutlierResult& r) {
    return r.method == "reference" && r.seed == result.seed &&
           r.share_percent == result.share_percent;
  });
  if (reference == study.results.end() || !(reference->rms_m > 0.0)) return std::nullopt;
  return result.rms_m / reference->rms_m;
}

// Median and worst; the value alone of a single seed.
std::string both(const Statistics& values, const auto& text) {
  if (values.count == 1) return text(values.max);
  return text(values.median) + " / " + text(values.max);
}

std::vector<std::string> row_of(const OutlierStudy& study, Cell cell) {
  const OutlierResult& any = cell.front();
  const auto number = [](int digits) {
    return [digits](double value) { return rounded(value, digits); };
  };
  const auto counted = [&](auto OutlierResult::*member) {
    return both(statistics(cell, member), number(6));
  };
  std::vector<double> ratios;
  for (const OutlierResult& r : cell)
    if (const auto ratio = ratio_of(study, r)) ratios.push_back(*ratio);
  const bool decided = std::ranges::all_of(cell, &OutlierResult::decided);
  return {any.method,
          rounded(any.share_percent, 6) + " %",
          counted(&OutlierResult::false_closures),
          counted(&OutlierResult::false_kept),
          counted(&OutlierResult::true_closures),
          counted(&OutlierResult::true_lost),
          counted(&OutlierResult::between_lost),
          counted(&OutlierResult::frames) + (decided ? "" : "+"),
          both(statistics(cell, &OutlierResult::max_m), number(3)),
          both(statistics(cell, &OutlierResult::rms_m), number(3)),
          ratios.empty() ? "-" : both(statistics_of(ratios), number(3)),
          counted(&OutlierResult::rounds),
          both(statistics(cell, &OutlierResult::bytes), bytes_text),
          both(statistics(cell, &OutlierResult::cpu_s), number(2))};
}

}  // namespace

std::string outlier_text(const OutlierStudy& study) {
  std::ostringstream text;
  if (!study.scenario.empty()) text << study.scenario << ": ";
  text << study.poses << " poses, " << study.robots << (study.robots == 1 ? " robot" : " robots")
       << "; the truth is the optimum without false closures, which is "
       << (study.certified ? "certified\n" : "NOT certified\n");
  std::vector<std::vector<std::string>> rows{{"method", "share", "false", "kept", "true", "lost",
                                              "between robots", "frames", "max m", "rms m", "ratio",
                                              "rounds", "sent", "CPU s"}};
  for (const Cell& cell : cells_of(study)) rows.push_back(row_of(study, cell));
  text << align_columns(rows);
  if (!std::ranges::all_of(study.results, &OutlierResult::decided))
    text << "+: came to no end in time\n";
  return text.str();
}

void write_outlier_json(std::ostream& out, const OutlierStudy& study) {
  Json results = Json::array();
  for (const OutlierResult& r : study.results) {
    const auto ratio = ratio_of(study, r);
    results.push_back({{"method", r.method},
                       {"share_percent", r.share_percent},
                       {"seed", r.seed},
                       {"true_closures", r.true_closures},
                       {"true_lost", r.true_lost},
                       {"between_robots", r.between},
                       {"between_robots_lost", r.between_lost},
                       {"false_closures", r.false_closures},
                       {"false_kept", r.false_kept},
                       {"frames", r.frames},
                       {"max_m", r.max_m},
                       {"rms_m", r.rms_m},
                       {"ratio", ratio ? Json(*ratio) : Json()},
                       {"rounds", r.rounds},
                       {"bytes", r.bytes},
                       {"decided", r.decided},
                       {"cpu_s", r.cpu_s}});
  }
  out << json_text({{"scenario", study.scenario},
                    {"poses", study.poses},
                    {"robots", study.robots},
                    {"certified", study.certified},
                    {"results", std::move(results)}});
}

}  // namespace km
