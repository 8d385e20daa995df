#pragma once

#include <string>

namespace km {

/// The shortest text that reads back as the same double.
[[nodiscard]] std::string number_text(double value);

}  // namespace km
