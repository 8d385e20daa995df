#include "modules/place_recognition/place_database.hpp"

#include <algorithm>
#include <cmath>
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
  const Stamp newest = stamp - nanoseconds(config_.min_gap_s);
  const auto end = std::upper_bound(stamps_.begin(), stamps_.end(), newest);
  return search_among(query, score(query, last_),
                      std::max(static_cast<std::size_t>(end - stamps_.begin()), known_from_));
}

CandidateSearch PlaceDatabase::search_among(const BowVector& query, double normalizer,
                                            std::size_t count) const {
  CandidateSearch result;
  result.normalizer = normalizer;
  if (result.normalizer <= 0.0 || result.normalizer < config_.min_normalizer) {
    result.status = SearchStatus::kLowNormalizer;
    return result;
  }
  const BowMatches matches = database_.query(
      query, {.last = count, .min_score = config_.similarity_threshold * result.normalizer});
  result.compared = matches.compared;
  result.above = matches.above;
  result.best_similarity = static_cast<double>(matches.best_score) / result.normalizer;
  for (const BowMatch& match : matches.best)
    choose(
        {.index = match.index, .similarity = static_cast<double>(match.score) / result.normalizer},
        result.candidates);
  count_support(result.candidates);
  return result;
}

// Adds a keyframe to the chosen ones if there is room, and if it is far enough from them in time.
void PlaceDatabase::choose(const PlaceCandidate& found, std::vector<PlaceCandidate>& chosen) const {
  if (chosen.size() == static_cast<std::size_t>(config_.max_candidates)) return;
  const bool is_new = std::ranges::all_of(chosen, [&](const PlaceCandidate& other) {
    return other.index != found.index &&
           std::abs(seconds_between(stamps_[other.index], stamps_[found.index])) >=
               config_.candidate_separation_s;
  });
  if (is_new) chosen.push_back(found);
}

}  // namespace km
