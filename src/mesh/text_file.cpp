#include "mesh/text_file.h"

#include <charconv>
#include <cmath>

#include "base/error.h"

namespace pellicle {

TextFile::TextFile(const std::string& path) : path_(path), stream_(path) {
  if (!stream_) {
    throw Error(path + ": cannot be opened for reading");
  }
}

bool TextFile::next_line() {
  words_.clear();
  used_ = 0;
  while (std::getline(stream_, line_)) {
    ++line_number_;
    // A backslash at the end joins the next line to this one.
    while (!line_.empty() && line_.back() == '\\') {
      line_.back() = ' ';
      std::string more;
      if (!std::getline(stream_, more)) {
        break;
      }
      ++line_number_;
      line_ += more;
    }
    const std::string_view text = std::string_view(line_).substr(0, line_.find('#'));
    constexpr std::string_view blanks = " \t\r\v\f";
    for (std::size_t begin = text.find_first_not_of(blanks); begin != std::string_view::npos;) {
      const std::size_t end = std::min(text.find_first_of(blanks, begin), text.size());
      words_.push_back(text.substr(begin, end - begin));
      begin = text.find_first_not_of(blanks, end);
    }
    if (!words_.empty()) {
      return true;
    }
  }
  return false;
}

std::string_view TextFile::next_word(const char* expected) {
  if (used_ == words_.size() && !next_line()) {
    throw Error(path_ + ": ends at line " + std::to_string(line_number_) + ", expected " + expected);
  }
  return words_[used_++];
}

double TextFile::number(std::string_view word, const char* expected) const {
  double value = 0;
  const char* begin = word.data() + (word.size() > 1 && word.front() == '+' ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto [stop, code] = std::from_chars(begin, end, value);
  // A value too small for a double is as good as zero; one too large is an error.
  const bool underflow = code == std::errc::result_out_of_range && std::abs(std::strtod(begin, nullptr)) < 1;
  if ((code != std::errc() && !underflow) || stop != end || !std::isfinite(value)) {
    fail("'" + std::string(word) + "', expected " + expected + " (a finite number)");
  }
  return value;
}

int TextFile::integer(std::string_view word, const char* expected) const {
  int value = 0;
  const char* end = word.data() + word.size();
  const auto [stop, code] = std::from_chars(word.data(), end, value);
  if (code != std::errc() || stop != end) {
    fail("'" + std::string(word) + "', expected " + expected + " (an integer)");
  }
  return value;
}

void TextFile::fail(const std::string& message) const {
  throw Error(path_ + ":" + std::to_string(line_number_) + ": " + message);
}

}  // namespace pellicle
