#include "apps/lab/pgo/scenario_report.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "modules/core/json.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

const ScenarioResult* reference_of(const ScenarioStudy& study, unsigned seed) {
  const auto found = std::ranges::find_if(study.results, [&](const ScenarioResult& r) {
    return r.method == "reference" && r.seed == seed;
  });
  return found == study.results.end() ? nullptr : &*found;
}

std::optional<double> ratio_of(const ScenarioStudy& study, const ScenarioResult& result) {
  const ScenarioResult* reference = reference_of(study, result.seed);
  if (reference == nullptr || !(reference->rms_m > 0.0)) return std::nullopt;
  return result.rms_m / reference->rms_m;
}

std::string part_text(std::size_t part, std::size_t of) {
  return std::to_string(part) + " of " + std::to_string(of);
}

// The method, and its threshold unless that is the default.
std::string name_of(const ScenarioResult& r) {
  return r.threshold > 0.0 ? r.method + ' ' + rounded(r.threshold, 4) : r.method;
}

// Names of all results, in the order of the study.
std::vector<std::string> names_of(const ScenarioStudy& study) {
  std::vector<std::string> names;
  for (const ScenarioResult& r : study.results)
    if (std::ranges::find(names, name_of(r)) == names.end()) names.push_back(name_of(r));
  return names;
}

// "median / worst".
std::string both(std::vector<double> values, int digits) {
  const Statistics statistics = statistics_of(std::move(values));
  return rounded(statistics.median, digits) + " / " + rounded(statistics.max, digits);
}

std::string seeds_text(const ScenarioStudy& study) {
  const std::string name = name_of(study.results.front());
  std::vector<std::vector<std::string>> rows{{"seed", "true lost", "between robots", "false kept",
                                              "frames", "tentative", "max m", "rms m",
                                              "reference max m", "rms m", "ratio"}};
  for (const ScenarioResult& r : study.results) {
    if (name_of(r) != name) continue;
    const ScenarioResult* reference = reference_of(study, r.seed);
    const auto ratio = ratio_of(study, r);
    rows.push_back(
        {std::to_string(r.seed), part_text(r.true_lost, r.true_closures),
         part_text(r.between_lost, r.between), part_text(r.false_kept, r.false_closures),
         std::to_string(r.frames) + (r.decided ? "" : "+"), std::to_string(r.tentative),
         rounded(r.max_m, 3), rounded(r.rms_m, 3), reference ? rounded(reference->max_m, 3) : "-",
         reference ? rounded(reference->rms_m, 3) : "-", ratio ? rounded(*ratio, 3) : "-"});
  }
  return name + ":\n" + align_columns(rows);
}

std::string methods_text(const ScenarioStudy& study) {
  std::vector<std::vector<std::string>> rows{{"median / worst", "true lost", "between robots",
                                              "false kept", "frames", "tentative", "max m", "rms m",
                                              "ratio", "CPU s"}};
  for (const std::string& name : names_of(study)) {
    std::vector<double> lost, between, kept, frames, tentative, max_m, rms_m, ratios, cpu_s;
    bool decided = true;
    for (const ScenarioResult& r : study.results) {
      if (name_of(r) != name) continue;
      lost.push_back(static_cast<double>(r.true_lost));
      between.push_back(static_cast<double>(r.between_lost));
      kept.push_back(static_cast<double>(r.false_kept));
      frames.push_back(static_cast<double>(r.frames));
      tentative.push_back(static_cast<double>(r.tentative));
      max_m.push_back(r.max_m);
      rms_m.push_back(r.rms_m);
      cpu_s.push_back(r.cpu_s);
      if (const auto ratio = ratio_of(study, r)) ratios.push_back(*ratio);
      decided = decided && r.decided;
    }
    rows.push_back({name + (decided ? "" : "+"), both(lost, 5), both(between, 5), both(kept, 5),
                    both(frames, 5), both(tentative, 5), both(max_m, 3), both(rms_m, 3),
                    ratios.empty() ? "-" : both(ratios, 3), both(cpu_s, 2)});
  }
  return align_columns(rows);
}

Plot panel_of(const ScenarioStudy& study, const std::string& title,
              double ScenarioResult::*ordinate) {
  Plot plot{.title = title, .x_label = "seed", .y_label = "m", .log_y = true};
  for (const std::string& name : names_of(study)) {
    PlotSeries series{name, {}, plot.series.size(), PlotSeries::Style::kMarkedLine};
    for (const ScenarioResult& r : study.results)
      if (name_of(r) == name) series.points.push_back({static_cast<double>(r.seed), r.*ordinate});
    plot.series.push_back(std::move(series));
  }
  return plot;
}

double percent(std::size_t part, std::size_t of) {
  return of == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(of);
}

// Receiver operating characteristic: one point per threshold, over the closures of all seeds.
Plot characteristic_of(const ScenarioStudy& study) {
  Plot plot{.title = "True and false closures kept, one point per threshold",
            .x_label = "false closures kept [%]",
            .y_label = "true closures kept [%]"};
  struct Sum {
    std::size_t true_kept = 0, true_all = 0, false_kept = 0, false_all = 0;
  };
  std::map<std::string, std::map<double, Sum>> methods;
  for (const ScenarioResult& r : study.results) {
    Sum& sum = methods[r.method][r.threshold];
    sum.true_kept += r.true_closures - r.true_lost;
    sum.true_all += r.true_closures;
    sum.false_kept += r.false_kept;
    sum.false_all += r.false_closures;
  }
  for (const auto& [method, sums] : methods) {
    PlotSeries series{method, {}, plot.series.size(), PlotSeries::Style::kMarkedLine};
    for (const auto& [threshold, sum] : sums)
      series.points.push_back(
          {percent(sum.false_kept, sum.false_all), percent(sum.true_kept, sum.true_all)});
    plot.series.push_back(std::move(series));
  }
  return plot;
}

}  // namespace

std::string scenario_text(const ScenarioStudy& study) {
  std::ostringstream text;
  text << (study.scenario.empty() ? "scenario" : study.scenario) << ": " << study.poses
       << " poses, " << study.robots << (study.robots == 1 ? " robot" : " robots")
       << "; the truth is the optimum of the graph, which is "
       << (study.certified ? "certified\n" : "NOT certified\n");
  if (study.results.empty()) return text.str();
  text << '\n' << seeds_text(study) << '\n' << methods_text(study);
  if (!std::ranges::all_of(study.results, &ScenarioResult::decided))
    text << "+: came to no end in time\n";
  return text.str();
}

void write_scenario_json(std::ostream& out, const ScenarioStudy& study) {
  Json results = Json::array();
  for (const ScenarioResult& r : study.results) {
    const auto ratio = ratio_of(study, r);
    results.push_back({{"method", r.method},
                       {"seed", r.seed},
                       {"threshold", r.threshold},
                       {"true_closures", r.true_closures},
                       {"true_lost", r.true_lost},
                       {"between_robots", r.between},
                       {"between_robots_lost", r.between_lost},
                       {"false_closures", r.false_closures},
                       {"false_kept", r.false_kept},
                       {"frames", r.frames},
                       {"tentative", r.tentative},
                       {"max_m", r.max_m},
                       {"rms_m", r.rms_m},
                       {"ratio", ratio ? Json(*ratio) : Json()},
                       {"decided", r.decided},
                       {"cpu_s", r.cpu_s}});
  }
  out << json_text({{"scenario", study.scenario},
                    {"poses", study.poses},
                    {"robots", study.robots},
                    {"certified", study.certified},
                    {"results", std::move(results)}});
}

void write_scenario_csv(std::ostream& out, const ScenarioStudy& study) {
  out << "scenario,method,seed,threshold,true_closures,true_lost,between_robots,between_robots_"
         "lost,"
         "false_closures,false_kept,frames,tentative,max_m,rms_m,ratio,decided,cpu_s\n";
  for (const ScenarioResult& r : study.results) {
    const auto ratio = ratio_of(study, r);
    out << study.scenario << ',' << r.method << ',' << r.seed << ',' << r.threshold << ','
        << r.true_closures << ',' << r.true_lost << ',' << r.between << ',' << r.between_lost << ','
        << r.false_closures << ',' << r.false_kept << ',' << r.frames << ',' << r.tentative << ','
        << r.max_m << ',' << r.rms_m << ',';
    if (ratio) out << *ratio;
    out << ',' << r.decided << ',' << r.cpu_s << '\n';
  }
}

std::vector<Plot> scenario_plots(const ScenarioStudy& study) {
  return {characteristic_of(study),
          panel_of(study, "RMSE of positions to the truth", &ScenarioResult::rms_m),
          panel_of(study, "Largest error of a position", &ScenarioResult::max_m)};
}

}  // namespace km
