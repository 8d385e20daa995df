#pragma once

#include <iosfwd>
#include <span>
#include <string>

#include "apps/lab/pgo/pcm_run.hpp"

namespace km {

/// Table of the run at about ten sizes of its graph, and its totals, as text.
[[nodiscard]] std::string pcm_text(const PcmRun& run);

/// One object for one run: {"search", "additions": [{"vertices", "check_s", "search_s", "clique",
/// "true_members", "false_members"}]}. "true_members" and "false_members" count the closures of the
/// clique by label. Several runs are an array of such objects.
void write_pcm_json(std::ostream& out, std::span<const PcmRun> runs);

}  // namespace km
