// PNG pictures. Check sums are corrected before an input is read, since otherwise every change would be refused there.

#include <zlib.h>

#include <cmath>
#include <cstdlib>

#include "io/texture.h"
#include "tests/fuzz/target.h"

namespace {

std::uint32_t number_at(const std::string& bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    number = number << 8 | static_cast<std::uint8_t>(bytes[at + k]);
  }
  return number;
}

void correct_check_sums(std::string& bytes) {
  // A chunk: length of its data, type, data, check sum of type and data.
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    const std::size_t length = number_at(bytes, at);
    if (length > bytes.size() - at - 12) {
      return;
    }
    const auto sum = crc32(0, reinterpret_cast<const Bytef*>(bytes.data() + at + 4), static_cast<uInt>(length + 4));
    for (std::size_t k = 0; k < 4; ++k) {
      bytes[at + 8 + length + k] = static_cast<char>(sum >> (24 - 8 * k) & 255);
    }
    at += 12 + length;
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pellicle;
  std::string bytes(reinterpret_cast<const char*>(data), size);
  correct_check_sums(bytes);
  expect_sound(write_input(reinterpret_cast<const std::uint8_t*>(bytes.data()), size, ".png"),
               [](const std::string& path) {
                 for (const double value : read_png(path).grey) {
                   if (!(value >= 0 && value <= 1)) {
                     std::abort();
                   }
                 }
               });
  return 0;
}
