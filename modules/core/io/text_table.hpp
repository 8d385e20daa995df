#pragma once

#include <string>
#include <vector>

namespace km {

/// Rows of cells as aligned text: the first column to the left, the others to the right, two blanks
/// between columns. The first row is the header.
[[nodiscard]] std::string align_columns(const std::vector<std::vector<std::string>>& rows);

/// `value` with `decimals` decimals; "-" if it is not finite.
[[nodiscard]] std::string fixed(double value, int decimals);

/// `value` with `digits` significant digits, without trailing zeros: "0.012", "2.5e+07".
[[nodiscard]] std::string rounded(double value, int digits);

/// "812 B", "34.5 kB", "1.2 MB".
[[nodiscard]] std::string bytes_text(double bytes);

}  // namespace km
