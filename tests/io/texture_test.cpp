#include "io/texture.h"

#include <gtest/gtest.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <zlib.h>

#include <functional>

#include "tests/io/files.h"

namespace pellicle {
namespace {

/// Writes a PNG whose channel values are given by a formula of column, row (from the lower edge) and channel. Rank 0.
void write_png(const TestFolder& folder, const std::string& path, int width, int height, int channels, int type,
               const std::function<double(int, int, int)>& value) {
  if (folder.rank() == 0) {
    vtkNew<vtkImageData> image;
    image->SetDimensions(width, height, 1);
    image->AllocateScalars(type, channels);
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        for (int channel = 0; channel < channels; ++channel) {
          image->SetScalarComponentFromDouble(column, row, 0, channel, value(column, row, channel));
        }
      }
    }
    vtkNew<vtkPNGWriter> writer;
    writer->SetFileName(path.c_str());
    writer->SetInputData(image);
    writer->Write();
  }
  MPI_Barrier(MPI_COMM_WORLD);
}

std::string big_endian(unsigned number) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) {
    bytes += static_cast<char>(number >> shift & 255);
  }
  return bytes;
}

std::string chunk(const std::string& type, const std::string& data) {
  const std::string content = type + data;
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size()));
  return big_endian(static_cast<unsigned>(data.size())) + content + big_endian(static_cast<unsigned>(sum));
}

std::string deflated(const std::string& data) {
  uLongf size = compressBound(data.size());
  std::string result(size, '\0');
  compress(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(data.data()), data.size());
  result.resize(size);
  return result;
}

TEST(Texture, SamplesBilinearlyFromTheLowerEdge) {
  const TestFolder folder;
  const std::string path = folder / "grey.png";
  const auto grey = [](int column, int row, int) { return 10.0 * column + 50.0 * row; };
  write_png(folder, path, 4, 2, 1, VTK_UNSIGNED_CHAR, grey);
  const Texture texture = Texture::read(MPI_COMM_WORLD, path);
  EXPECT_EQ(texture.width, 4);
  EXPECT_EQ(texture.height, 2);
  // Centres of the pixels.
  EXPECT_NEAR(texture.sample(0.125, 0.25), 0, 1e-12);
  EXPECT_NEAR(texture.sample(0.875, 0.25), 30 / 255.0, 1e-12);
  EXPECT_NEAR(texture.sample(0.125, 0.75), 50 / 255.0, 1e-12);
  // The values are linear in both directions, so between centres the formula holds.
  EXPECT_NEAR(texture.sample(0.45, 0.6), (10 * (0.45 * 4 - 0.5) + 50 * (0.6 * 2 - 0.5)) / 255, 1e-12);
  // The edge's value goes on beyond the outer centres.
  EXPECT_NEAR(texture.sample(0, 0), 0, 1e-12);
  EXPECT_NEAR(texture.sample(1, 1), 80 / 255.0, 1e-12);
  EXPECT_NEAR(texture.sample(7, -3), 30 / 255.0, 1e-12);
}

TEST(Texture, ColourIsTheMeanAndTransparencyIsDropped) {
  const TestFolder folder;
  write_png(folder, folder / "rgba.png", 2, 2, 4, VTK_UNSIGNED_CHAR,
            [](int, int, int channel) { return channel == 3 ? 7.0 : 60.0 * channel; });
  EXPECT_NEAR(Texture::read(MPI_COMM_WORLD, folder / "rgba.png").sample(0.5, 0.5), 60 / 255.0, 1e-12);
  write_png(folder, folder / "grey_alpha.png", 2, 2, 2, VTK_UNSIGNED_CHAR,
            [](int, int, int channel) { return channel == 1 ? 7.0 : 255.0; });
  EXPECT_NEAR(Texture::read(MPI_COMM_WORLD, folder / "grey_alpha.png").sample(0.5, 0.5), 1, 1e-12);
  write_png(folder, folder / "deep.png", 2, 2, 1, VTK_UNSIGNED_SHORT, [](int, int, int) { return 13107.0; });
  EXPECT_NEAR(Texture::read(MPI_COMM_WORLD, folder / "deep.png").sample(0.5, 0.5), 0.2, 1e-12);
}

TEST(Texture, FaultyFilesAreOneErrorOnAllRanks) {
  const TestFolder folder;
  const auto message = [&](const std::string& path) {
    return error_text([&] { Texture::read(MPI_COMM_WORLD, path); });
  };
  EXPECT_EQ(message(folder / "none.png"), (folder / "none.png") + ": no such file: expected a PNG texture");
  write_png(folder, folder / "whole.png", 64, 64, 1, VTK_UNSIGNED_CHAR,
            [](int column, int row, int) { return (column * 37 + row * row) % 256; });
  if (folder.rank() == 0) {
    write_file(folder / "text.png", "no picture");
    write_file(folder / "empty.png", "");
    const std::string whole = file_text(folder / "whole.png");
    write_file(folder / "cut.png", whole.substr(0, whole.size() / 2));
    write_file(folder / "head.png", whole.substr(0, 20));
    std::string flipped = whole;
    flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 1);
    write_file(folder / "flipped.png", flipped);
  }
  MPI_Barrier(MPI_COMM_WORLD);
  for (const char* name : {"text.png", "empty.png", "cut.png", "head.png", "flipped.png"}) {
    const std::string expected = (folder / name) + ": expected a PNG picture: the file is damaged or something else (";
    EXPECT_EQ(message(folder / name).substr(0, expected.size()), expected);
  }
}

/// A PNG with right check sums round whatever data.
std::string png(unsigned width, unsigned height, int depth, int colour, const std::string& chunks, int interlaced = 0) {
  std::string header = big_endian(width) + big_endian(height);
  for (const int value : {depth, colour, 0, 0, interlaced}) {
    header += static_cast<char>(value);
  }
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + chunks + chunk("IEND", "");
}

TEST(Texture, SoundCheckSumsRoundUnsoundDataAreRefused) {
  const TestFolder folder;
  const std::string few = chunk("IDAT", deflated(std::string(100, '\0')));
  const auto expect_refused = [&](const std::string& content, const std::string& part) {
    if (folder.rank() == 0) {
      write_file(folder / "a.png", content);
    }
    MPI_Barrier(MPI_COMM_WORLD);
    const std::string message = error_text([&] { Texture::read(MPI_COMM_WORLD, folder / "a.png"); });
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is not in '" << message << "'";
    MPI_Barrier(MPI_COMM_WORLD);
  };
  expect_refused(png(64, 64, 8, 0, few), "Not enough image data");
  expect_refused(png(0, 64, 8, 0, few), "Invalid IHDR data");
  expect_refused(png(64, 64, 8, 0, ""), "the file is damaged");
  expect_refused(png(64, 64, 8, 0, chunk("IDAT", "hello world")), "the file is damaged");
  expect_refused(png(64, 64, 8, 3, few), "Missing PLTE");
  expect_refused(png(64, 64, 8, 5, few), "Invalid IHDR data");
  expect_refused(png(20000, 20000, 8, 0, few), "a.png: a picture of 20000 x 20000 pixels, expected at most 67108864");
  const std::string colours = chunk("PLTE", std::string("\0\0\0\xFF\xFF\xFF\x33\x33\x33", 9));
  const std::string row = chunk("IDAT", deflated(std::string({'\0', '\2', '\3'})));
  expect_refused(png(2, 1, 8, 3, colours + row),
                 "a.png: the pixel in column 1, row 0 (from 0) has colour 3 of a palette of 3, expected one of");
  const std::string bits = chunk("IDAT", deflated(std::string({'\0', '\x1B'})));  // 0, 1, 2, 3
  expect_refused(png(4, 1, 2, 3, colours + bits), "the pixel in column 3, row 0 (from 0) has colour 3 of a palette");
  const std::string endless = png(4, 4, 8, 0, chunk("IDAT", deflated(std::string(20, '\0'))));
  expect_refused(endless.substr(0, endless.size() - 12), "the file is damaged");
}

TEST(Texture, EveryKindOfPngIsRead) {
  const TestFolder folder;
  const auto values = [&](const std::string& content) {
    if (folder.rank() == 0) {
      write_file(folder / "a.png", content);
    }
    MPI_Barrier(MPI_COMM_WORLD);
    const Texture texture = Texture::read(MPI_COMM_WORLD, folder / "a.png");
    MPI_Barrier(MPI_COMM_WORLD);
    std::vector<double> row;
    for (int column = 0; column < texture.width; ++column) {
      row.push_back(texture.sample((column + 0.5) / texture.width, 0));
    }
    return row;
  };
  const auto data = [](const std::string& bytes) { return chunk("IDAT", deflated(bytes)); };
  using Row = std::vector<double>;
  EXPECT_EQ(values(png(4, 1, 1, 0, data({'\0', '\x50'}))), (Row{0, 1, 0, 1}));  // bits 0101
  EXPECT_EQ(values(png(2, 1, 4, 0, data({'\0', '\xF3'}))), (Row{1, 0.2}));
  EXPECT_EQ(values(png(1, 1, 16, 0, data({'\0', '\x33', '\x33'}))), (Row{0.2}));
  const std::string palette = chunk("PLTE", std::string("\0\0\0\xFF\xFF\xFF\x33\x33\x33", 9));
  EXPECT_EQ(values(png(3, 1, 8, 3, palette + data({'\0', '\2', '\1', '\0'}))), (Row{0.2, 1, 0}));
  EXPECT_EQ(values(png(3, 1, 2, 3, palette + data({'\0', '\x84'}))), (Row{0.2, 0, 1}));  // of two bits: 2, 0, 1
  EXPECT_EQ(values(png(1, 1, 8, 6, data({'\0', '\x33', '\x33', '\x33', '\7'}))), (Row{0.2}));
  // Interlaced: pass 1 has pixel 0, pass 4 pixel 2, pass 6 pixels 1 and 3, each with its filter byte.
  EXPECT_EQ(values(png(4, 1, 8, 0, data({'\0', '\0', '\0', '\x66', '\0', '\x33', '\xFF'}), 1)), (Row{0, 0.2, 0.4, 1}));
}

TEST(Texture, TheTexturesOfTheDecksVary) {
  const Texture texture =
      Texture::read(MPI_COMM_WORLD, std::string(PELLICLE_SOURCE_DIR) + "/input/textures/fibres.png");
  double lowest = 1;
  double highest = 0;
  double sum = 0;
  for (int row = 0; row < 100; ++row) {
    for (int column = 0; column < 100; ++column) {
      const double value = texture.sample((column + 0.5) / 100, (row + 0.5) / 100);
      lowest = std::min(lowest, value);
      highest = std::max(highest, value);
      sum += value / 10000;
    }
  }
  EXPECT_LT(lowest, 0.15);
  EXPECT_GT(highest, 0.85);
  EXPECT_NEAR(sum, 0.5, 0.05);
}

}  // namespace
}  // namespace pellicle
