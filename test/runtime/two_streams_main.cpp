#include <ostream>

#include "runtime/unblocked_output.hpp"

// Writes as many lines as its argument says to each of its two streams in turn, and ends.
int main(int /*argc*/, char** argv) {
  for (int i = 0; i < std::atoi(argv[1]); ++i) {
    km::unblocked_stdout() << "out " << i << std::endl;
    km::unblocked_stderr() << "err " << i << std::endl;
  }
}
