#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "apps/pgo/scenario_study.hpp"
#include "modules/charts/plot.hpp"

namespace km {

/// A row per seed of the first method beside the reference, then a row per method: median and worst
/// of all seeds.
[[nodiscard]] std::string scenario_text(const ScenarioStudy& study);

/// Every run. `ratio` is of the RMS error to that of the reference with the same seed; without a
/// reference it is null in JSON and empty in CSV.
void write_scenario_json(std::ostream& out, const ScenarioStudy& study);
void write_scenario_csv(std::ostream& out, const ScenarioStudy& study);

/// RMS and largest error of each method by seed.
[[nodiscard]] std::vector<Plot> scenario_plots(const ScenarioStudy& study);

}  // namespace km
