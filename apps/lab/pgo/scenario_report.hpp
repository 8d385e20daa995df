#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "apps/lab/pgo/scenario_study.hpp"
#include "modules/charts/plot.hpp"

namespace km {

/// Text with one row per seed for the first method beside the reference, then one row per method
/// and threshold with median and worst of all seeds.
[[nodiscard]] std::string scenario_text(const ScenarioStudy& study);

/// Every run. `ratio` is the RMS error divided by that of the reference with the same seed. Without
/// a reference it is null in JSON and empty in CSV.
void write_scenario_json(std::ostream& out, const ScenarioStudy& study);
void write_scenario_csv(std::ostream& out, const ScenarioStudy& study);

/// Plots of the receiver operating characteristic of each method, and of its RMS and largest error
/// by seed.
[[nodiscard]] std::vector<Plot> scenario_plots(const ScenarioStudy& study);

}  // namespace km
