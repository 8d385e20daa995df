#include "modules/place_recognition/bow_database.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace km {
namespace {

void require_valid(const BowVector& vector, std::size_t words) {
  if (vector.words.size() != vector.weights.size())
    throw std::invalid_argument("BowDatabase::add: " + std::to_string(vector.words.size()) +
                                " words with " + std::to_string(vector.weights.size()) +
                                " weights");
  for (std::size_t i = 0; i < vector.words.size(); ++i) {
    const auto at = [&](const char* what) {
      return "BowDatabase::add: word " + std::to_string(vector.words[i]) + what;
    };
    if (vector.words[i] >= words)
      throw std::invalid_argument(at(" is not in the vocabulary of ") + std::to_string(words));
    if (i > 0 && vector.words[i] <= vector.words[i - 1])
      throw std::invalid_argument(at(" is not above the one before"));
    if (!std::isfinite(vector.weights[i]) || vector.weights[i] <= 0.0F)
      throw std::invalid_argument(at(" has weight ") + std::to_string(vector.weights[i]));
  }
}

bool better(const BowMatch& a, const BowMatch& b) {
  return a.score != b.score ? a.score > b.score : a.index < b.index;
}

}  // namespace

std::size_t BowDatabase::add(const BowVector& vector) {
  require_valid(vector, postings_.size());
  for (std::size_t i = 0; i < vector.words.size(); ++i)
    postings_[vector.words[i]].push_back({static_cast<std::uint32_t>(size_), vector.weights[i]});
  return size_++;
}

std::vector<float> BowDatabase::accumulate(const BowVector& vector, std::size_t last) const {
  std::vector<float> scores(last, 0.0F);
  for (std::size_t i = 0; i < vector.words.size(); ++i)
    for (const auto& [image, weight] : postings_[vector.words[i]]) {
      if (image >= last) break;
      scores[image] += std::min(vector.weights[i], weight);
    }
  return scores;
}

std::vector<BowMatch> BowDatabase::query(const BowVector& vector, const BowQuery& query) const {
  std::vector<BowMatch> found;
  const std::vector<float> scores = accumulate(vector, std::min(query.last, size_));
  for (std::size_t i = 0; i < scores.size(); ++i)
    if (scores[i] > 0.0F && static_cast<double>(scores[i]) >= query.min_score)
      found.push_back({i, scores[i]});
  const std::size_t kept = std::min(query.max_matches, found.size());
  std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end(),
                    better);
  found.resize(kept);
  return found;
}

}  // namespace km
