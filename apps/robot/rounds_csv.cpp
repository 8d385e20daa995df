#include "apps/robot/rounds_csv.hpp"

#include "modules/core/text_rows.hpp"

namespace km {

RoundsCsv::RoundsCsv(std::ostream& output, std::string_view former) : output_(output) {
  if (former.empty()) output_ << "seconds,round,members,cost,gradient_norm\n";
  for (const TextRow& row : split_rows(former)) {
    former_s_ = number_in(row, 0).value_or(former_s_);
    former_rounds_ =
        static_cast<std::uint32_t>(number_in(row, 1).value_or(static_cast<double>(former_rounds_)));
  }
}

void RoundsCsv::append(const std::vector<OptimizerProgress>& rounds) {
  for (; written_ < rounds.size(); ++written_) {
    const OptimizerProgress& row = rounds[written_];
    output_ << former_s_ + row.seconds << ',' << former_rounds_ + row.round << ','
            << row.members.size() << ',' << row.cost << ',' << row.gradient_norm << '\n';
  }
}

}  // namespace km
