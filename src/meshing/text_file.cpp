#include "meshing/text_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <utility>

#include "base/error.h"

namespace pellicle {
inline namespace meshing {

namespace {

constexpr std::string_view blanks = " \t\r\v\f";

void split(std::string_view text, std::vector<std::string_view>& words) {
  words.clear();
  for (std::size_t begin = text.find_first_not_of(blanks); begin != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(blanks, begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(blanks, end);
  }
}

}  // namespace

TextFile::TextFile(const std::string& path, Syntax syntax)
    : path_(path), syntax_(std::move(syntax)), stream_(path, std::ios::binary) {
  std::error_code failure;
  size_ = static_cast<std::size_t>(std::filesystem::file_size(path, failure));
  if (!stream_ || failure) {
    throw Error(path + ": cannot be opened for reading");
  }
  // Some editors put a byte order mark in front of a text.
  std::string mark(3, '\0');
  if (!stream_.read(mark.data(), 3) || mark != "\xEF\xBB\xBF") {
    stream_.clear();
    stream_.seekg(0);
  } else {
    begin_ = mark.size();
  }
}

/// The next line, without what ends it. Nothing at the end of the file.
std::optional<std::string> TextFile::read_line() {
  if (rest_ == std::string::npos) {
    begin_ += length_;
    length_ = 0;
    if (!std::getline(stream_, lines_)) {
      return std::nullopt;
    }
    length_ = lines_.size() + 1;
    rest_ = 0;
    if (!lines_.empty() && lines_.find('\r') == lines_.size() - 1) {
      lines_.pop_back();
    }
  }
  const std::size_t end = lines_.find('\r', rest_);
  std::string line = lines_.substr(rest_, end - rest_);
  rest_ = end == std::string::npos ? end : end + 1;
  if (line.find('\0') != std::string::npos) {
    ++line_number_;
    fail("a zero byte, expected text");
  }
  return line;
}

std::string TextFile::without_comment(std::string line) const {
  line.erase(std::min(line.size(), syntax_.comments ? line.find('#') : line.size()));
  return line;
}

bool TextFile::next_line() {
  words_.clear();
  used_ = 0;
  while (std::optional<std::string> line = ahead_ ? std::exchange(ahead_, std::nullopt) : read_line()) {
    ++line_number_;
    line_ = without_comment(std::move(*line));
    while (!syntax_.keywords.empty()) {
      const std::size_t last = line_.find_last_not_of(blanks);
      if (last == std::string::npos || line_[last] != '\\') {
        break;
      }
      line_[last] = ' ';
      std::optional<std::string> more = read_line();
      if (!more) {
        break;
      }
      const std::string text = without_comment(*more);
      split(text, words_);
      if (!words_.empty() && syntax_.keywords.count(words_.front()) != 0) {
        ahead_ = std::move(more);
        break;
      }
      ++line_number_;
      line_ += text;
    }
    split(line_, words_);
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
  const char* begin = word.data() + (word.size() > 1 && word.front() == '+' && word[1] != '-' ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto [stop, code] = std::from_chars(begin, end, value);
  if (code == std::errc::result_out_of_range && stop == end) {
    fail("'" + std::string(word) + "', expected " + expected + " (an integer of at most " +
         std::to_string(std::numeric_limits<int>::max()) + ")");
  }
  if (code != std::errc() || stop != end) {
    fail("'" + std::string(word) + "', expected " + expected + " (an integer)");
  }
  return value;
}

int TextFile::count(std::string_view word, const char* expected, std::size_t bytes) const {
  const int value = integer(word, expected);
  if (value < 0 || static_cast<std::size_t>(value) > size_ / bytes) {
    fail("'" + std::string(word) + "', expected " + expected + ", 0 to " + std::to_string(size_ / bytes) +
         " in a file of " + std::to_string(size_) + " bytes");
  }
  return value;
}

void TextFile::fail(const std::string& message) const {
  throw Error(path_ + ":" + std::to_string(line_number_) + ": " + message);
}

}  // namespace meshing
}  // namespace pellicle
