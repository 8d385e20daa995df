#pragma once

#include <string>

#include "modules/core/json_writer.hpp"
#include "modules/evaluation/closure_truth.hpp"

namespace km {

/// A table for people: a line per stage with how many closures are true, precision, recall over
/// pairs and over keyframes, and the errors of the measured poses; below, what recall counts.
[[nodiscard]] std::string to_table(const ClosureScores& scores);

/// Writes the same numbers as one JSON object: {true_pairs, true_frames, unjudged, candidates:
/// {judged, correct, precision, pairs_found, pair_recall, frames_found, frame_recall,
/// translation_error_m: {...}, rotation_error_deg: {...}}, verified: {...}, inliers: {...}}.
void write_json(JsonWriter& json, const ClosureScores& scores);

}  // namespace km
