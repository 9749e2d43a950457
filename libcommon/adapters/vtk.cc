// VTK's compressors behind a table of C functions.
#include <vtkLZ4DataCompressor.h>
#include <vtkLZMADataCompressor.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkSmartPointer.h>
#include <vtkVersion.h>

#include <new>

extern "C" {
#include "adapters/vtk.h"
}

namespace {

// VTK reports errors by printing them and then goes on.  Here they are only counted.
class Listener : public vtkOutputWindow {
public:
    static Listener *New();
    vtkTypeMacro(Listener, vtkOutputWindow);
    void DisplayText(const char *) override {}
    void DisplayErrorText(const char *) override { errors++; }
    void DisplayWarningText(const char *) override {}
    void DisplayGenericWarningText(const char *) override {}
    void DisplayDebugText(const char *) override {}
    int errors = 0;
};
vtkStandardNewMacro(Listener);

int unpack_guarded(vtkDataCompressor *compressor, const void *in, size_t in_size, void *out, size_t out_size)
{
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF); // it would print beside the output window
    vtkNew<Listener> listener;
    vtkSmartPointer<vtkOutputWindow> before = vtkOutputWindow::GetInstance();
    vtkOutputWindow::SetInstance(listener);
    struct Restore {
        vtkOutputWindow *window;
        ~Restore() { vtkOutputWindow::SetInstance(window); }
    } restore{before};
    size_t got = compressor->Uncompress(static_cast<const unsigned char *>(in), in_size,
                                        static_cast<unsigned char *>(out), out_size);
    return got == out_size && listener->errors == 0 ? VOL_VTK_DONE : VOL_VTK_BAD;
}

extern "C" int unpack(int lzma, const void *in, size_t in_size, void *out, size_t out_size)
{
    try {
        vtkSmartPointer<vtkDataCompressor> compressor;
        if (lzma)
            compressor = vtkSmartPointer<vtkLZMADataCompressor>::New();
        else
            compressor = vtkSmartPointer<vtkLZ4DataCompressor>::New();
        return unpack_guarded(compressor, in, in_size, out, out_size);
    } catch (const std::bad_alloc &) {
        return VOL_VTK_NO_MEMORY;
    } catch (...) {
        return VOL_VTK_BAD;
    }
}

} // namespace

extern "C" __attribute__((visibility("default"))) const VolVtkAdapter pellucid_vtk_adapter;
const VolVtkAdapter pellucid_vtk_adapter = {VOL_VTK_ADAPTER_VERSION, "VTK " VTK_VERSION, unpack};
