#pragma once

#include <cstddef>

#include "apps/experiments/experiment_plan.hpp"

namespace km {

/// What the report says, in short.
struct ReportSummary {
  std::filesystem::path html, markdown;
  std::size_t targets = 0, met = 0;  ///< Numbers to reach that were judged.
};

/// Writes report.html, report.md with its figures/, and numbers.json, which has every table, to
/// the folder of results. Throws std::runtime_error for results that cannot be read and files that
/// cannot be written.
ReportSummary write_report(const ExperimentConfig& config, const ExperimentPaths& paths);

}  // namespace km
