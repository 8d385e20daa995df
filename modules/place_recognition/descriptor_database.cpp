#include "modules/place_recognition/descriptor_database.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

namespace km {
namespace {

// At most 128 products of at most 2^14, so that 32 bits suffice.
std::int32_t product(const std::vector<std::int8_t>& a, const std::vector<std::int8_t>& b) {
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::int32_t{a[i]} * std::int32_t{b[i]};
  return sum;
}

}  // namespace

double cosine(const ImageDescriptor& a, const ImageDescriptor& b) {
  if (a.network != b.network || a.values.size() != b.values.size()) return 0.0;
  const double squares = static_cast<double>(product(a.values, a.values)) *
                         static_cast<double>(product(b.values, b.values));
  return squares > 0.0 ? static_cast<double>(product(a.values, b.values)) / std::sqrt(squares)
                       : 0.0;
}

std::vector<DescriptorMatch> DescriptorDatabase::search(const ImageDescriptor& query, double least,
                                                        std::size_t last) const {
  std::vector<DescriptorMatch> matches;
  if (query.values.empty()) return matches;
  for (std::size_t i = 0; i < std::min(last, descriptors_.size()); ++i)
    if (const double value = cosine(query, descriptors_[i]); value >= least)
      matches.push_back({i, value});
  std::ranges::stable_sort(matches, std::ranges::greater(), &DescriptorMatch::cosine);
  return matches;
}

}  // namespace km
