#include "modules/place_recognition/place_database.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

constexpr std::size_t kBeside = 3;

void count_support(std::vector<PlaceCandidate>& candidates) {
  for (PlaceCandidate& one : candidates)
    one.support = static_cast<int>(
        std::count_if(candidates.begin(), candidates.end(), [&](const PlaceCandidate& other) {
          return std::max(one.index, other.index) - std::min(one.index, other.index) <= kBeside;
        }));
}

}  // namespace

PlaceDatabase::PlaceDatabase(const PlaceRecognitionConfig& config, std::size_t words)
    : config_(checked(config)), database_(words) {}

std::size_t PlaceDatabase::add(BowVector vector, Stamp stamp) {
  expect_order(stamp);
  const std::size_t index = database_.add(vector);
  stamps_.push_back(stamp);
  newest_ = stamp;
  view_ = vector;
  last_ = std::move(vector);
  return index;
}

bool PlaceDatabase::is_view(const BowVector& keyframe) const {
  if (keyframe.words.empty()) return false;
  return view_.words.empty() || score(keyframe, view_) < config_.new_view_score;
}

void PlaceDatabase::pass(BowVector vector, Stamp stamp) {
  expect_order(stamp);
  newest_ = stamp;
  last_ = std::move(vector);
}

void PlaceDatabase::expect_order(Stamp stamp) const {
  if (stamp < newest_)
    throw std::invalid_argument("PlaceDatabase: stamp " + std::to_string(stamp) + " is before " +
                                std::to_string(newest_));
}

CandidateSearch PlaceDatabase::search(const BowVector& query, double normalizer) const {
  return search_among(query, normalizer, stamps_.size());
}

CandidateSearch PlaceDatabase::search_own(const BowVector& query, Stamp stamp) const {
  const Stamp newest = stamp - nanoseconds(kMinGap_s);
  const auto end = std::upper_bound(stamps_.begin(), stamps_.end(), newest);
  return search_among(query, score(query, last_),
                      std::max(static_cast<std::size_t>(end - stamps_.begin()), known_from_));
}

CandidateSearch PlaceDatabase::search_among(const BowVector& query, double normalizer,
                                            std::size_t count) const {
  CandidateSearch result{.normalizer = normalizer, .candidates = {}};
  if (!(normalizer >= kMinNormalizer)) return result;
  for (const auto& [index, score] :
       database_.query(query, {.last = count,
                              .min_score = config_.similarity_threshold * normalizer,
                              .max_matches = static_cast<std::size_t>(config_.max_candidates)}))
    result.candidates.push_back(
        {.index = index, .similarity = static_cast<double>(score) / normalizer});
  count_support(result.candidates);
  return result;
}

}  // namespace km
