// VTK's readers behind a table of C functions: files whole in memory in, one array out.
#include <vtkCallbackCommand.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkLogger.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkStructuredPoints.h>
#include <vtkStructuredPointsReader.h>
#include <vtkVersion.h>
#include <vtkXMLImageDataReader.h>

#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <system_error>

extern "C" {
#include "adapters/vtk.h"
}

namespace {

enum Result { done = 0, bad_input = 1, out_of_memory = 2, damaged = 3 };

// VTK reports errors by printing them and then goes on with what it has.  Here they are kept instead, and end the
// import.
class Listener : public vtkOutputWindow {
public:
    static Listener *New();
    vtkTypeMacro(Listener, vtkOutputWindow);
    void DisplayText(const char *) override {}
    void DisplayErrorText(const char *text) override { keep(text); }
    void DisplayWarningText(const char *text) override { judge(text); }
    void DisplayGenericWarningText(const char *text) override { judge(text); }
    void DisplayDebugText(const char *) override {}
    std::string first;

private:
    // The legacy reader only warns of data that end early ("Error reading binary data!").
    void judge(const char *text)
    {
        if (text && (strstr(text, "Error") || strstr(text, "error")))
            keep(text);
    }
    void keep(const char *text)
    {
        if (first.empty() && text)
            first = text;
        if (first.empty())
            first = "unknown error";
    }
};
vtkStandardNewMacro(Listener);

// "ERROR: In file.cxx, line 12\nvtkClass (0x..): the message\n\n" -> "the message"
std::string reason(const std::string &text)
{
    size_t begin = text.find("): "), newline = text.find('\n');
    std::string line = text;
    if (begin != std::string::npos)
        line = text.substr(begin + 3);
    else if (newline != std::string::npos && newline + 1 < text.size() && text.find(", line ") < newline)
        line = text.substr(newline + 1);
    while (!line.empty() && strchr("\n .!", line.back()))
        line.pop_back();
    for (char &c : line)
        c = c == '\n' ? ' ' : c;
    if (line.size() > 1 && line[0] >= 'A' && line[0] <= 'Z' && line[1] >= 'a')
        line[0] = (char)(line[0] - 'A' + 'a');
    return line.empty() ? "unknown error" : line;
}

Result say(char *why, size_t size, const std::string &text, Result result = bad_input)
{
    snprintf(why, size, "%s", text.c_str());
    return result;
}

const char *sample_name(int type)
{
    switch (type) {
    case VTK_UNSIGNED_CHAR: return "u8";
    case VTK_CHAR:
    case VTK_SIGNED_CHAR: return "i8";
    case VTK_UNSIGNED_SHORT: return "u16";
    case VTK_SHORT: return "i16";
    case VTK_UNSIGNED_INT: return "u32";
    case VTK_INT: return "i32";
    case VTK_UNSIGNED_LONG: return sizeof(long) == 8 ? "u64" : "u32";
    case VTK_LONG: return sizeof(long) == 8 ? "i64" : "i32";
    case VTK_ID_TYPE: return sizeof(vtkIdType) == 8 ? "i64" : "i32";
    case VTK_UNSIGNED_LONG_LONG: return "u64";
    case VTK_LONG_LONG: return "i64";
    case VTK_FLOAT: return "f32";
    case VTK_DOUBLE: return "f64";
    default: return nullptr;
    }
}

struct Choice {
    vtkDataArray *array = nullptr;
    bool cells = false;
};

std::string list_arrays(vtkImageData *image)
{
    std::string list;
    vtkDataSetAttributes *const sets[] = {image->GetPointData(), image->GetCellData()};
    for (vtkDataSetAttributes *set : sets)
        for (int i = 0; i < set->GetNumberOfArrays(); i++)
            if (vtkDataArray *array = set->GetArray(i))
                list += (list.empty() ? "" : ", ") +
                        std::string(array->GetName() ? array->GetName() : "(unnamed)") + " (" +
                        std::to_string(array->GetNumberOfComponents()) + ", " +
                        (set == image->GetPointData() ? "points" : "cells") + ")";
    return list.empty() ? "none" : list;
}

// The named array, of points first; without a name the active scalars, else the only array there is.
Choice choose_array(vtkImageData *image, const char *name)
{
    vtkDataSetAttributes *const sets[] = {image->GetPointData(), image->GetCellData()};
    Choice only;
    int count = 0;
    for (vtkDataSetAttributes *set : sets) {
        bool cells = set == image->GetCellData();
        if (name && set->GetArray(name))
            return {set->GetArray(name), cells};
        if (!name && set->GetScalars())
            return {set->GetScalars(), cells};
        for (int i = 0; i < set->GetNumberOfArrays(); i++)
            if (set->GetArray(i)) {
                only = {set->GetArray(i), cells};
                count++;
            }
    }
    return !name && count == 1 ? only : Choice();
}

// Samples of cells lie in the middle between the points.
void fill_geometry(vtkImageData *image, bool cells, VolVtkImage *out)
{
    int extent[6];
    image->GetExtent(extent);
    const double *spacing = image->GetSpacing(), *direction = image->GetDirectionMatrix()->GetData();
    for (int to = 0; to < 3; to++)
        out->index_to_world[3][to] = image->GetOrigin()[to];
    for (int a = 0; a < 3; a++) {
        long long points = (long long)extent[2 * a + 1] - extent[2 * a] + 1;
        bool between = cells && points > 1;
        out->dims[a] = between ? points - 1 : points;
        for (int to = 0; to < 3; to++) {
            double step = direction[3 * to + a] * spacing[a];
            out->index_to_world[a][to] = step;
            out->index_to_world[3][to] += step * (extent[2 * a] + (between ? 0.5 : 0.0));
        }
    }
}

Result copy_array(vtkImageData *image, const char *name, VolVtkImage *out, char *why, size_t why_size)
{
    Choice choice = choose_array(image, name);
    if (!choice.array)
        return say(why, why_size,
                   (name ? "there is no array '" + std::string(name) + "'"
                         : std::string("no scalars are active, and one array is to be chosen by --array")) +
                       ": there are " + list_arrays(image));
    out->sample = sample_name(choice.array->GetDataType());
    if (!out->sample)
        return say(why, why_size,
                   std::string("values of type ") + choice.array->GetDataTypeAsString() + " are not read");
    fill_geometry(image, choice.cells, out);
    out->components = choice.array->GetNumberOfComponents();
    long long tuples = choice.array->GetNumberOfTuples();
    if (tuples != out->dims[0] * out->dims[1] * out->dims[2])
        return say(why, why_size, "the array has " + std::to_string(tuples) + " values, the image " +
                                      std::to_string(out->dims[0] * out->dims[1] * out->dims[2]));
    out->size = (size_t)tuples * (size_t)out->components * (size_t)choice.array->GetDataTypeSize();
    out->data = malloc(out->size ? out->size : 1);
    if (!out->data)
        return out_of_memory;
    memcpy(out->data, choice.array->GetVoidPointer(0), out->size);
    return done;
}

void keep_error(vtkObject *, unsigned long, void *client, void *text)
{
    std::string *first = static_cast<std::string *>(client);
    if (first->empty())
        *first = text ? static_cast<const char *>(text) : "unknown error";
}

Result read_xml(const void *bytes, size_t size, long long time_step, Listener *listener,
                vtkSmartPointer<vtkImageData> *image, long long *times, char *why, size_t why_size)
{
    std::string error;
    vtkNew<vtkCallbackCommand> observer;
    observer->SetCallback(keep_error);
    observer->SetClientData(&error);
    vtkNew<vtkXMLImageDataReader> reader;
    reader->AddObserver("ErrorEvent", observer);
    reader->ReadFromInputStringOn();
    reader->SetInputString(std::string(static_cast<const char *>(bytes), size));
    reader->UpdateInformation();
    *times = reader->GetNumberOfTimeSteps() > 0 ? reader->GetNumberOfTimeSteps() : 1;
    if (time_step < *times)
        reader->SetTimeStep((int)time_step);
    if (error.empty() && listener->first.empty())
        reader->Update();
    if (!error.empty() || !listener->first.empty())
        return say(why, why_size, reason(error.empty() ? listener->first : error), damaged);
    *image = reader->GetOutput();
    return done;
}

Result read_legacy(const void *bytes, size_t size, Listener *listener, vtkSmartPointer<vtkImageData> *image,
                   char *why, size_t why_size)
{
    if (size > INT_MAX)
        return say(why, why_size, "legacy files of more than 2 GB are not read");
    std::string error;
    vtkNew<vtkCallbackCommand> observer;
    observer->SetCallback(keep_error);
    observer->SetClientData(&error);
    vtkNew<vtkStructuredPointsReader> reader;
    reader->AddObserver("ErrorEvent", observer);
    reader->ReadFromInputStringOn();
    reader->SetBinaryInputString(static_cast<const char *>(bytes), (int)size);
    reader->ReadAllScalarsOn();
    reader->ReadAllVectorsOn();
    reader->ReadAllNormalsOn();
    reader->ReadAllTensorsOn();
    reader->ReadAllColorScalarsOn();
    reader->ReadAllTCoordsOn();
    reader->ReadAllFieldsOn();
    reader->Update();
    if (!error.empty() || !listener->first.empty())
        return say(why, why_size, reason(error.empty() ? listener->first : error), damaged);
    *image = reader->GetOutput();
    return done;
}

Result read_image_guarded(const void *bytes, size_t size, int xml, const char *array, long long time_step,
                          VolVtkImage *out, char *why, size_t why_size)
{
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF); // it would print beside the output window
    vtkNew<Listener> listener;
    vtkSmartPointer<vtkOutputWindow> before = vtkOutputWindow::GetInstance();
    vtkOutputWindow::SetInstance(listener);
    struct Restore {
        vtkOutputWindow *window;
        ~Restore() { vtkOutputWindow::SetInstance(window); }
    } restore{before};

    vtkSmartPointer<vtkImageData> image;
    out->times = 1;
    Result result = xml ? read_xml(bytes, size, time_step, listener, &image, &out->times, why, why_size)
                        : read_legacy(bytes, size, listener, &image, why, why_size);
    if (result != done)
        return result;
    if (!image || image->GetNumberOfPoints() < 1)
        return say(why, why_size, "it holds no image");
    return copy_array(image, array, out, why, why_size);
}

extern "C" int read_image(const void *bytes, size_t size, int xml, const char *array, long long time_step,
                          VolVtkImage *out, char *why, size_t why_size)
{
    *out = VolVtkImage();
    try {
        return read_image_guarded(bytes, size, xml, array, time_step, out, why, why_size);
    } catch (const std::bad_alloc &) {
        return out_of_memory;
    } catch (const std::system_error &e) { // threads
        return e.code() == std::errc::resource_unavailable_try_again ? out_of_memory : say(why, why_size, e.what());
    } catch (const std::exception &e) {
        return say(why, why_size, e.what());
    } catch (...) {
        return say(why, why_size, "unknown error");
    }
}

} // namespace

extern "C" __attribute__((visibility("default"))) const VolVtkAdapter pellucid_vtk_adapter;
const VolVtkAdapter pellucid_vtk_adapter = {VOL_VTK_ADAPTER_VERSION, "VTK " VTK_VERSION, read_image};
