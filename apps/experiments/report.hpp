#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "apps/experiments/experiment_plan.hpp"
#include "apps/experiments/report_document.hpp"
#include "apps/experiments/report_input.hpp"

namespace km {

/// What `value` says of the numbers of a method of optimisation; NaN, shown as "-", if there are
/// none.
[[nodiscard]] double of_method(ReportInput& input, const ReportInput::World& world,
                               const std::string& method, const auto& value) {
  const PgoNumbers* const pgo = input.pgo(*world.config, method);
  return pgo == nullptr ? std::numeric_limits<double>::quiet_NaN()
                        : static_cast<double>(value(*pgo));
}

/// Values of the same quantity in several runs.
struct Spread {
  std::size_t count = 0;
  double median = 0.0;  ///< Mean of the middle two for an even count.
  double lowest = 0.0, highest = 0.0;
};

/// Values that are not finite are left out; all zero without any.
[[nodiscard]] Spread spread_of(std::vector<double> values);

/// Of what `value` says of each of the runs.
[[nodiscard]] Spread spread_over(const auto& runs, const auto& value) {
  std::vector<double> values;
  for (const auto& run : runs) values.push_back(value(run));
  return spread_of(std::move(values));
}

/// The median; where there are several values, with "lowest to highest" in grey below it (in
/// brackets in the Markdown). "-" without values.
[[nodiscard]] ReportCell spread_cell(const Spread& spread, int decimals);

/// " (30 to 39 in 3 runs)", to stand behind the median; empty for a single value.
[[nodiscard]] std::string range_text(const Spread& spread, int decimals);

/// The sections of the report; each adds its numbers to reach to `input`. nullopt where there is no
/// result at all; of what is there in part the rest is left out. All throw std::runtime_error for
/// results that cannot be read.
[[nodiscard]] std::optional<ReportSection> pcm_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> cosmo_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> trajectory_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> resources_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> mesh_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> semantics_section(ReportInput& input);

/// All numbers to reach, after the other sections were made.
[[nodiscard]] ReportSection targets_section(const ReportInput& input);

/// What the report says, in short.
struct ReportSummary {
  std::filesystem::path html, markdown;
  std::size_t targets = 0, met = 0;  ///< Numbers to reach that were judged.
};

/// Writes report.html, report.md and numbers.json, which has every table, to the folder of results.
/// Throws std::runtime_error for results that cannot be read and files that cannot be written.
ReportSummary write_report(const ExperimentConfig& config, const ExperimentPaths& paths);

}  // namespace km
