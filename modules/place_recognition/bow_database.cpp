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

std::vector<float> BowDatabase::accumulate(const BowVector& vector, std::size_t first,
                                           std::size_t last) const {
  std::vector<float> scores(last - first, 0.0F);
  const auto is_before = [](const Posting& posting, std::size_t image) {
    return posting.image < image;
  };
  for (std::size_t i = 0; i < vector.words.size(); ++i) {
    const std::vector<Posting>& postings = postings_[vector.words[i]];
    // The postings of the next word are loaded while those of this word are added.
    if (i + 1 < vector.words.size()) __builtin_prefetch(postings_[vector.words[i + 1]].data());
    const float weight = vector.weights[i];
    auto posting = postings.begin();
    auto end = postings.end();
    if (first > 0) posting = std::lower_bound(posting, end, first, is_before);
    if (last < size_) end = std::lower_bound(posting, end, last, is_before);
    for (; posting != end; ++posting)
      scores[posting->image - first] += std::min(weight, posting->weight);
  }
  return scores;
}

BowMatches BowDatabase::query(const BowVector& vector, const BowQuery& query) const {
  BowMatches result;
  const std::size_t last = std::min(query.last, size_);
  if (query.first >= last) return result;
  const std::vector<float> scores = accumulate(vector, query.first, last);
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (scores[i] <= 0.0F) continue;
    ++result.compared;
    result.best_score = std::max(result.best_score, scores[i]);
    if (static_cast<double>(scores[i]) >= query.min_score)
      result.best.push_back({query.first + i, scores[i]});
  }
  result.above = result.best.size();
  const std::size_t kept = std::min(query.max_matches, result.best.size());
  std::partial_sort(result.best.begin(), result.best.begin() + static_cast<std::ptrdiff_t>(kept),
                    result.best.end(), better);
  result.best.resize(kept);
  return result;
}

}  // namespace km
