#include "modules/evaluation/closure_report.hpp"

#include <cmath>
#include <iomanip>
#include <sstream>

namespace km {
namespace {

std::string percent(double share) {
  if (!std::isfinite(share)) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << 100.0 * share << '%';
  return text.str();
}

std::string number(const Statistics& statistics, double value, int decimals) {
  if (statistics.count == 0) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(decimals) << value;
  return text.str();
}

void write_row(std::ostream& out, const char* name, const ClosureScores& scores,
               const StageScore& stage) {
  const Statistics& t = stage.translation_error_m;
  const Statistics& r = stage.rotation_error_deg;
  out << std::left << std::setw(11) << name << std::right << std::setw(8) << stage.judged
      << std::setw(8) << stage.correct << std::setw(11) << percent(stage.precision())
      << std::setw(15) << percent(scores.pair_recall(stage)) << std::setw(19)
      << percent(scores.frame_recall(stage)) << std::setw(12) << number(t, t.median, 3)
      << std::setw(9) << number(t, t.max, 3) << std::setw(14) << number(r, r.median, 2)
      << std::setw(11) << number(r, r.max, 2) << '\n';
}

void write_statistics(JsonWriter& json, const char* name, const Statistics& statistics) {
  json.key(name);
  json.begin_object();
  json.field("rmse", statistics.rmse);
  json.field("median", statistics.median);
  json.field("max", statistics.max);
  json.end_object();
}

void write_stage(JsonWriter& json, const char* name, const ClosureScores& scores,
                 const StageScore& stage) {
  json.key(name);
  json.begin_object();
  json.field("judged", stage.judged);
  json.field("correct", stage.correct);
  json.field("precision", stage.precision());
  json.field("pairs_found", stage.pairs_found);
  json.field("pair_recall", scores.pair_recall(stage));
  json.field("frames_found", stage.frames_found);
  json.field("frame_recall", scores.frame_recall(stage));
  if (stage.translation_error_m.count > 0) {
    write_statistics(json, "translation_error_m", stage.translation_error_m);
    write_statistics(json, "rotation_error_deg", stage.rotation_error_deg);
  }
  json.end_object();
}

}  // namespace

std::string to_table(const ClosureScores& scores) {
  std::ostringstream out;
  out << "closures     judged    true  precision  recall, pairs  recall, keyframes"
         "  median [m]  max [m]  median [deg]  max [deg]\n";
  write_row(out, "candidates", scores, scores.candidates);
  write_row(out, "verified", scores, scores.verified);
  write_row(out, "inliers", scores, scores.inliers);
  out << scores.true_pairs << " pairs of keyframes of two robots see the same place, in them "
      << scores.true_frames << " keyframes";
  if (scores.unjudged > 0) out << "; " << scores.unjudged << " closures are without a true pose";
  out << ".\n";
  return out.str();
}

void write_json(JsonWriter& json, const ClosureScores& scores) {
  json.begin_object();
  json.field("true_pairs", scores.true_pairs);
  json.field("true_frames", scores.true_frames);
  json.field("unjudged", scores.unjudged);
  write_stage(json, "candidates", scores, scores.candidates);
  write_stage(json, "verified", scores, scores.verified);
  write_stage(json, "inliers", scores, scores.inliers);
  json.end_object();
}

}  // namespace km
