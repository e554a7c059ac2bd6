// Builds scenes of small glTF files for tests.
#pragma once

#include "support/gltf_file.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe::test {

/// Builds glTF files that are seen by an orthographic camera at (0,0,5), along -z, at x and y from -1 to 1.
class GltfSceneTest : public testing::Test {
  protected:
    GltfSceneTest() {
        options.resolution = V2i(8, 8);
        options.samplesPerPixel = 4;
    }
    /// Returns a file with the camera, a light without intensity, which prevents the default studio, and an
    /// unlit white material.
    static GltfFile unlitFile() {
        GltfFile file;
        file.root["cameras"] = {{{"type", "orthographic"},
                                 {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0}, {"zfar", 9}}}}};
        file.addNode({{"camera", 0}, {"translation", {0, 0, 5}}});
        file.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", 0}}};
        file.addNode({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
        file.root["materials"] = {{{"extensions", {{"KHR_materials_unlit", json::object()}}}}};
        return file;
    }
    BuiltScene build(const GltfFile& file) { return buildPath(m_folder.write("model.gltf", file.text())); }
    /// Builds a scene that includes the file by a directive, as "model.gltf".
    BuiltScene build(const GltfFile& file, const std::string& directive) {
        m_folder.write("model.gltf", file.text());
        return buildPath(m_folder.write("test.scene", "WorldBegin\n" + directive));
    }
    float centerOf(const BuiltScene& built) { return render(built).image.at(4, 4).x; }

    BuildOptions options;
    std::vector<std::string> warnings;

  private:
    BuiltScene buildPath(const std::filesystem::path& path) {
        Diagnostics diagnostics([this](const std::string& text) { warnings.push_back(text); });
        return buildScene(parseFiles({path}, {"supersample"}, diagnostics), options, diagnostics);
    }

    GltfFolder m_folder;
};

} // namespace strobe::test
