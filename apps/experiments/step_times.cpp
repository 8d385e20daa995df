#include "apps/experiments/step_times.hpp"

#include <utility>

namespace km {

void StepTimes::add(std::string program, double thought_s) {
  steps_.push_back({std::move(program), thought_s});
}

void StepTimes::note(std::size_t index, double took_s) {
  const auto& [program, thought_s] = steps_.at(index);
  Pace& pace = paces_[program];
  pace.took_s += took_s;
  pace.thought_s += thought_s;
}

double StepTimes::expected_s(std::size_t index) const {
  const auto& [program, thought_s] = steps_.at(index);
  const auto pace = paces_.find(program);
  if (pace == paces_.end() || !(pace->second.thought_s > 0.0)) return thought_s;
  return thought_s * pace->second.took_s / pace->second.thought_s;
}

double StepTimes::later_s(std::size_t index) const {
  double sum_s = 0.0;
  for (std::size_t k = index + 1; k < steps_.size(); ++k) sum_s += expected_s(k);
  return sum_s;
}

}  // namespace km
