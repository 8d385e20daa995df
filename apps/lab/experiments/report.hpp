#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "apps/lab/experiments/experiment_plan.hpp"
#include "apps/lab/experiments/report_document.hpp"
#include "apps/lab/experiments/report_input.hpp"

namespace km {

/// Returns `value` of the results of an optimisation method; NaN, shown as "-", if there are none.
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

/// Ignores values that are not finite; all zero if no value remains.
[[nodiscard]] Spread spread_of(std::vector<double> values);

/// Spread of `value` over the runs.
[[nodiscard]] Spread spread_over(const auto& runs, const auto& value) {
  std::vector<double> values;
  for (const auto& run : runs) values.push_back(value(run));
  return spread_of(std::move(values));
}

/// The median. If there are several values, "lowest to highest" follows in grey below it (in
/// brackets in the Markdown). "-" without values.
[[nodiscard]] ReportCell spread_cell(const Spread& spread, int decimals);

/// " (30 to 39 in 3 runs)", to follow the median; empty for a single value.
[[nodiscard]] std::string range_text(const Spread& spread, int decimals);

/// The sections of the report; each adds its targets to `input`. nullopt without any result;
/// missing parts are left out. All throw std::runtime_error for unreadable results.
[[nodiscard]] std::optional<ReportSection> pcm_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> cosmo_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> trajectory_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> resources_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> mesh_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> semantics_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> levels_section(ReportInput& input);

/// Returns the section of all targets. Precondition: the other sections have been made, because
/// they collect the targets.
[[nodiscard]] ReportSection targets_section(const ReportInput& input);

/// Files and totals of the report.
struct ReportSummary {
  std::filesystem::path html, markdown;
  std::size_t targets = 0, met = 0;  ///< Targets that were judged.
};

/// Writes report.html, report.md and numbers.json, which has every table, to the results folder.
/// Throws std::runtime_error for unreadable results and files that cannot be written.
ReportSummary write_report(const ExperimentConfig& config, const ExperimentPaths& paths);

}  // namespace km
