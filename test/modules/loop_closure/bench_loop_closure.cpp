#include <Eigen/LU>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>

#include "modules/evaluation/statistics.hpp"
#include "modules/loop_closure/matching.hpp"
#include "modules/loop_closure/verifier.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "test/modules/loop_closure/recorded_keyframes.hpp"
#include "test/support/shared_data.hpp"

// Tables of geometric verification on recorded keyframes against ground truth, and its speed.

namespace km {
namespace {

constexpr double kGross_m = 0.5;
constexpr double kGross_deg = 10.0;
constexpr double kQuantile95 = 12.592;  // chi-squared, 6 degrees of freedom

// A pair shows the same place if at least so many keypoints correspond, by descriptor and within
// 15 px and 15 px of disparity, under the TRUE relative pose.
constexpr std::size_t kOverlap = 30;
constexpr double kOverlapRadius_px = 15.0;

struct PairResult {
  Verification verification;
  double error_m = 0.0, error_deg = 0.0, chi2 = 0.0;
  bool overlaps = false;
  double similarity = 0.0;

  bool accepted() const { return verification.status == VerificationStatus::kAccepted; }
  bool gross() const { return error_m > kGross_m || error_deg > kGross_deg; }
};

bool overlap(const RecordedKeyframe& from, const RecordedKeyframe& to) {
  const SE3 T_from_to = from.T_world_body.inverse() * to.T_world_body;
  const SE3 T_a_b = from.features.T_body_cam.inverse() * T_from_to * to.features.T_body_cam;
  const GuidedMatchRules rules{kOverlapRadius_px, 0.9, 24};
  return match_guided(T_a_b, from.features, to.features, rules).size() >= kOverlap;
}

PairResult verify(const Verifier& verifier, const RecordedKeyframe& from,
                  const RecordedKeyframe& to) {
  PairResult result;
  result.verification = verifier.verify(from.features, to.features);
  result.overlaps = overlap(from, to);
  const SE3 T_true = from.T_world_body.inverse() * to.T_world_body;
  const SE3& T = result.verification.T_from_to;
  const Vector6 xi = se3_log(T.inverse() * T_true);
  result.error_m = (T.translation() - T_true.translation()).norm();
  result.error_deg = xi.head<3>().norm() * kDegrees;
  result.chi2 = xi.dot(result.verification.covariance.inverse() * xi);
  return result;
}

void print_table(const std::string& title, const std::vector<PairResult>& pairs) {
  std::vector<double> metres, degrees;
  int inside = 0, gross = 0, overlapping = 0;
  std::map<std::string, int> refusals;
  for (const PairResult& pair : pairs) {
    overlapping += pair.overlaps ? 1 : 0;
    if (!pair.accepted()) {
      ++refusals[to_string(pair.verification.status)];
      continue;
    }
    metres.push_back(pair.error_m);
    degrees.push_back(pair.error_deg);
    inside += pair.chi2 < kQuantile95 ? 1 : 0;
    gross += pair.gross() ? 1 : 0;
  }
  std::printf("%s: %zu pairs, %d overlap, %zu accepted\n", title.c_str(), pairs.size(), overlapping,
              metres.size());
  std::printf("  translation [m]  median %.3f  p90 %.3f  max %.3f\n", quantile(metres, 0.5),
              quantile(metres, 0.9), quantile(metres, 1.0));
  std::printf("  rotation [deg]   median %.2f   p90 %.2f   max %.2f\n", quantile(degrees, 0.5),
              quantile(degrees, 0.9), quantile(degrees, 1.0));
  std::printf("  beyond %.1f m or %.0f deg: %d; inside the 95 %% region: %.1f %%\n", kGross_m,
              kGross_deg, gross,
              100.0 * inside / std::max(1.0, static_cast<double>(metres.size())));
  for (const auto& [reason, count] : refusals) std::printf("  %5d %s\n", count, reason.c_str());
}

// Pairs (i, j) of one sequence, i < j: those across the split, or those on one side of it.
std::vector<PairResult> verify_pairs(const std::vector<RecordedKeyframe>& keyframes,
                                     std::size_t split, bool across) {
  const Verifier verifier({});
  std::vector<PairResult> results;
  for (std::size_t i = 0; i < keyframes.size(); ++i)
    for (std::size_t j = i + 1; j < keyframes.size(); ++j)
      if ((i < split && j >= split) == across)
        results.push_back(verify(verifier, keyframes[i], keyframes[j]));
  return results;
}

TEST_CASE("Closures against ground truth", "[loop_closure][!benchmark]") {
  const auto v1 = shared_data("euroc/V1_01_easy");
  const auto mh = shared_data("euroc/MH_01_easy");
  if (!v1 || !mh) return;
  const auto room = load_v1_01(*v1, {});
  print_table("V1_01, first 35 against the others", verify_pairs(room, 35, true));
  print_table("V1_01, pairs inside the two parts", verify_pairs(room, 35, false));
  const auto hall = load_mh_01(*mh, {});
  print_table("MH_01 at 2 Hz, first half against second",
              verify_pairs(hall, hall.size() / 2, true));
  print_table("MH_01 at 2 Hz, inside the halves", verify_pairs(hall, hall.size() / 2, false));
}

// As place recognition does it: the query's score against the match, over its score against the
// keyframe before it. Queries are the later keyframes. A keyframe has the words of its strongest
// `word_keypoints` keypoints.
void add_similarities(std::vector<PairResult>& pairs,
                      const std::vector<RecordedKeyframe>& keyframes, std::size_t split,
                      const Vocabulary& vocabulary, std::size_t word_keypoints) {
  std::vector<BowVector> vectors;
  for (const RecordedKeyframe& keyframe : keyframes) {
    const std::span all(keyframe.features.descriptors);
    vectors.push_back(vocabulary.transform(all.first(std::min(word_keypoints, all.size()))));
  }
  std::size_t k = 0;
  for (std::size_t i = 0; i < split; ++i)
    for (std::size_t j = split; j < keyframes.size(); ++j, ++k) {
      const double normalizer = j > split ? score(vectors[j], vectors[j - 1]) : 0.0;
      constexpr double kMinNormalizer = 0.05;
      pairs[k].similarity =
          normalizer >= kMinNormalizer ? score(vectors[j], vectors[i]) / normalizer : 0.0;
    }
}

void print_sweep(const std::vector<PairResult>& pairs) {
  const auto count = [&](auto&& property) {
    return static_cast<double>(std::count_if(pairs.begin(), pairs.end(), property));
  };
  const double overlapping = count([](const PairResult& p) { return p.overlaps; });
  std::printf("similarity  candidates  precision  recall   accepted  precision  recall\n");
  for (int step = 0; step <= 12; ++step) {
    const double threshold = 0.1 * step;
    const auto candidate = [&](const PairResult& p) { return p.similarity >= threshold; };
    const auto closure = [&](const PairResult& p) { return candidate(p) && p.accepted(); };
    const double candidates = count(candidate);
    const double hits = count([&](const PairResult& p) { return candidate(p) && p.overlaps; });
    const double closures = count(closure);
    const double right = count([&](const PairResult& p) { return closure(p) && !p.gross(); });
    const double found =
        count([&](const PairResult& p) { return closure(p) && !p.gross() && p.overlaps; });
    std::printf("   %4.1f     %7.0f      %6.3f    %6.3f   %7.0f    %6.3f    %6.3f\n", threshold,
                candidates, hits / std::max(candidates, 1.0), hits / overlapping, closures,
                right / std::max(closures, 1.0), found / overlapping);
  }
}

// KIMERA_MULTI_VOCABULARY names the vocabulary; by default the shipped one.
std::optional<KeypointDescriber> describer(bool by_network) {
  if (!by_network) return std::nullopt;
  return KeypointDescriber("config/networks/keypoints.onnx");
}

// Pairs across the split, where the later keyframe is reduced as in a reply.
void print_descriptors(const char* title, std::vector<RecordedKeyframe> keyframes,
                       std::size_t split) {
  for (std::size_t j = split; j < keyframes.size(); ++j)
    keyframes[j].features = reduced(keyframes[j].features, 200);
  print_table(title, verify_pairs(keyframes, split, true));
}

// No keyframe of one place shows the other one.
void print_two_places(const std::vector<RecordedKeyframe>& rooms,
                      const std::vector<RecordedKeyframe>& hall) {
  const Verifier verifier({});
  int accepted = 0, consensus = 0, largest = 0;
  for (const RecordedKeyframe& a : rooms)
    for (const RecordedKeyframe& b : hall) {
      const Verification found = verifier.verify(a.features, b.features);
      accepted += found.status == VerificationStatus::kAccepted ? 1 : 0;
      consensus += found.consensus >= LoopClosureConfig().min_consensus ? 1 : 0;
      largest = std::max(largest, found.consensus);
    }
  std::printf("two places: %zu pairs, %d pass the consensus (largest %d), %d accepted\n",
              rooms.size() * hall.size(), consensus, largest, accepted);
}

TEST_CASE("Keypoints by ORB and by the shipped network", "[loop_closure][!benchmark]") {
  const auto v1 = shared_data("euroc/V1_01_easy");
  const auto mh = shared_data("euroc/MH_01_easy");
  if (!v1 || !mh) return;
  for (const bool by_network : {false, true}) {
    std::printf(by_network ? "shipped network\n" : "ORB\n");
    print_descriptors("V1_01, 200 keypoints", load_v1_01(*v1, {}, 1, describer(by_network)), 35);
    const auto rooms = load_v1_01(*v1, {}, 4, describer(by_network));
    auto hall = load_mh_01(*mh, {}, describer(by_network));
    print_two_places(rooms, hall);
    const std::size_t half = hall.size() / 2;
    print_descriptors("MH_01, 200 keypoints", std::move(hall), half);
  }
}

TEST_CASE("Precision and recall over the similarity", "[loop_closure][!benchmark]") {
  const auto v1 = shared_data("euroc/V1_01_easy");
  if (!v1) return;
  const char* named = std::getenv("KIMERA_MULTI_VOCABULARY");
  std::filesystem::path file = named != nullptr ? named : "";
  if (named == nullptr && std::filesystem::is_directory("config/vocabulary"))
    for (const auto& entry : std::filesystem::directory_iterator("config/vocabulary"))
      if (entry.path().extension() == ".kmvoc") file = entry.path();
  if (!std::filesystem::exists(file)) {
    std::printf("no vocabulary: set KIMERA_MULTI_VOCABULARY\n");
    return;
  }
  const auto keyframes = load_v1_01(*v1, {});
  std::vector<PairResult> pairs = verify_pairs(keyframes, 35, true);
  const Vocabulary vocabulary = load_vocabulary(file);
  for (const std::size_t word_keypoints : {1000, 500, 350, 250}) {
    add_similarities(pairs, keyframes, 35, vocabulary, word_keypoints);
    std::printf("V1_01, first 35 against the others, %s, words of %zu keypoints\n", file.c_str(),
                word_keypoints);
    print_sweep(pairs);
  }
}

TEST_CASE("Speed of verification", "[loop_closure][!benchmark]") {
  const auto v1 = shared_data("euroc/V1_01_easy");
  if (!v1) return;
  const auto keyframes = load_v1_01(*v1, {});
  const Verifier verifier({});
  std::vector<std::pair<std::size_t, std::size_t>> accepted, refused;
  for (std::size_t i = 0; i < 35; ++i)
    for (std::size_t j = 35; j < 100; ++j) {
      const Verification result = verifier.verify(keyframes[i].features, keyframes[j].features);
      (result.status == VerificationStatus::kAccepted ? accepted : refused).emplace_back(i, j);
    }
  REQUIRE_FALSE(accepted.empty());
  std::size_t next = 0;
  const auto verify_next = [&](const auto& pairs) {
    const auto& [i, j] = pairs[next++ % pairs.size()];
    return verifier.verify(keyframes[i].features, keyframes[j].features);
  };
  BENCHMARK("verify, another accepted pair each time") {
    return verify_next(accepted);
  };
  BENCHMARK("verify, another refused pair each time") {
    return verify_next(refused);
  };
  BENCHMARK("match descriptors, 1000 x 1000") {
    return match_descriptors(keyframes[0].features, keyframes[50].features, {});
  };
}

TEST_CASE("Speed of the features of a keyframe", "[loop_closure][!benchmark]") {
  const auto v1 = shared_data("euroc/V1_01_easy");
  if (!v1) return;
  cv::setNumThreads(1);
  const SensorRig rig = read_euroc_rig(*v1 / "mav0");
  ReaderReport report;
  const auto files = list_keyframe_pairs(*v1 / "keyframes", report);
  std::vector<StereoFrame> frames;
  for (std::size_t i = 0; i < files.size(); i += 10)
    frames.push_back(load_stereo_pair(files[i], rig.stereo).image);
  std::size_t next = 0;
  for (const bool by_network : {false, true}) {
    KeyframeFeatureExtractor extractor(rig.stereo, {}, describer(by_network));
    BENCHMARK(by_network ? "another stereo pair each time, network"
                         : "another stereo pair each time") {
      return extractor.extract(frames[next++ % frames.size()]);
    };
  }
}

}  // namespace
}  // namespace km
