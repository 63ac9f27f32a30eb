#include <png.h>

#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>

#include "base/error.h"
#include "base/memory.h"
#include "io/texture.h"

namespace pellicle::io {

namespace {

/// libpng for a file. Called through `run` alone, because libpng leaves a fault by longjmp.
class Decoder {
 public:
  explicit Decoder(const std::string& path) : path_(path) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, keep_message, ignore_warning);
    info_ = png_ != nullptr ? png_create_info_struct(png_) : nullptr;
    if (info_ == nullptr) {
      png_destroy_read_struct(&png_, &info_, nullptr);
      throw std::bad_alloc();
    }
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { png_destroy_read_struct(&png_, &info_, nullptr); }

  /// Calls work(png, info), in which nothing may need a destructor: a fault jumps out of it. @throws Error on a fault
  template <class Work>
  void run(const Work& work) {
    if (setjmp(png_jmpbuf(png_)) != 0) {
      throw Error(path_ + ": expected a PNG picture: the file is damaged or something else (" + message_ + ")");
    }
    work(png_, info_);
  }

 private:
  [[noreturn]] static void keep_message(png_structp png, png_const_charp text) {
    auto* decoder = static_cast<Decoder*>(png_get_error_ptr(png));
    std::strncpy(decoder->message_, text, sizeof decoder->message_ - 1);
    png_longjmp(png, 1);
  }
  static void ignore_warning(png_structp, png_const_charp) {}

  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  const std::string& path_;
  /// libpng's own words on the fault: not a string, which would allocate on the way to a longjmp.
  char message_[200] = {};
};

}  // namespace

Texture read_png(const std::string& path) {
  constexpr double most_pixels = 1 << 26;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    throw Error(path + ": no such file: expected a PNG texture");
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (file == nullptr) {
    throw Error(path + ": cannot be opened for reading: " + std::strerror(errno));
  }
  Decoder decoder(path);
  Texture picture;
  decoder.run([&](png_structp png, png_infop info) {
    png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
    png_init_io(png, file.get());
    png_read_info(png, info);
    picture.width = static_cast<int>(png_get_image_width(png, info));
    picture.height = static_cast<int>(png_get_image_height(png, info));
  });
  const std::string what =
      path + ": a picture of " + std::to_string(picture.width) + " x " + std::to_string(picture.height) + " pixels";
  const double pixels = static_cast<double>(picture.width) * picture.height;
  if (pixels > most_pixels) {
    throw Error(what + ", expected at most 67108864 pixels, such as 8192 x 8192");
  }
  constexpr double bytes_of_a_pixel = 2 * sizeof(double) + 8;  // its values here and to be sent, and 4 times 16 bits
  require_memory(what, bytes_of_a_pixel * pixels);

  std::size_t row_bytes = 0;
  std::size_t channels = 0;
  std::size_t channel_bytes = 0;
  png_colorp palette = nullptr;  // the decoder's
  int colours = 0;
  decoder.run([&](png_structp png, png_infop info) {
    if (png_get_color_type(png, info) == PNG_COLOR_TYPE_PALETTE) {
      // libpng would give numbers beyond the palette some colour, without a word.
      png_set_packing(png);
      png_get_PLTE(png, info, &palette, &colours);
    } else {
      png_set_expand(png);  // fewer than 8 bits to 8, a transparent colour to a channel
      png_set_strip_alpha(png);
    }
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    row_bytes = png_get_rowbytes(png, info);
    channels = png_get_channels(png, info);
    channel_bytes = png_get_bit_depth(png, info) / 8;
  });
  const std::size_t height = picture.height;
  std::vector<unsigned char> bytes(row_bytes * height);
  std::vector<png_bytep> rows;
  for (std::size_t row = 0; row < height; ++row) {
    rows.push_back(bytes.data() + row * row_bytes);
  }
  decoder.run([&](png_structp png, png_infop) {
    png_read_image(png, rows.data());
    png_read_end(png, nullptr);
  });

  const double white = channel_bytes == 2 ? 65535 : 255;
  picture.grey.reserve(picture.width * height);
  for (std::size_t row = height; row-- > 0;) {
    const unsigned char* value = rows[row];
    for (int column = 0; column < picture.width; ++column) {
      if (palette != nullptr) {
        const int number = *value++;
        if (number >= colours) {
          throw Error(path + ": the pixel in column " + std::to_string(column) + ", row " + std::to_string(row) +
                      " (from 0) has colour " + std::to_string(number) + " of a palette of " + std::to_string(colours) +
                      ", expected one of the palette");
        }
        const png_color& colour = palette[number];
        picture.grey.push_back((colour.red + colour.green + colour.blue) / (3 * white));
        continue;
      }
      double sum = 0;
      for (std::size_t channel = 0; channel < channels; ++channel, value += channel_bytes) {
        sum += channel_bytes == 2 ? 256 * value[0] + value[1] : value[0];
      }
      picture.grey.push_back(sum / (static_cast<double>(channels) * white));
    }
  }
  return picture;
}

}  // namespace pellicle::io
