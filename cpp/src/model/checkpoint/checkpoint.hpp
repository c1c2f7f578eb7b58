// A pipeline as bytes.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "model/pipeline.hpp"

namespace nacre {

// See Model::save and Model::load. The same fields are written and read, so neither takes a const pipeline.
std::string save_checkpoint(Pipeline& pipeline, const std::string& note);
std::unique_ptr<Pipeline> load_checkpoint(std::string_view bytes, std::string* note, const std::string& points_folder);

}  // namespace nacre
