#!/usr/bin/python3
"""The picture `dense` by VTK's ray caster for processors:  peer_vtk.py RAW TF EYE AT FOV SIZE THREADS OUT

RAW: 256^3 floats; TF: lines of value, red, green, blue, extinction per voxel; OUT: rows from the bottom up, 8-bit RGB."""
import sys

import vtk
from math import exp

raw, tf, eye, at, fov, size, threads, out = sys.argv[1:]
point = lambda text: [float(x) for x in text.split(',')]
width, height = (int(x) for x in size.split('x'))

reader = vtk.vtkImageReader2()
reader.SetFileName(raw)
reader.SetFileDimensionality(3)
reader.SetDataExtent(0, 255, 0, 255, 0, 255)
reader.SetDataScalarTypeToFloat()
reader.SetDataByteOrderToLittleEndian()
reader.FileLowerLeftOn()

colour, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
for line in open(tf):
    value, red, green, blue, extinction = (float(x) for x in line.split())
    colour.AddRGBPoint(value, red, green, blue)
    opacity.AddPoint(value, 1 - exp(-extinction))
matter = vtk.vtkVolumeProperty()
matter.SetColor(colour)
matter.SetScalarOpacity(opacity)
matter.SetScalarOpacityUnitDistance(1)
matter.ShadeOff()
matter.SetInterpolationTypeToLinear()

mapper = vtk.vtkFixedPointVolumeRayCastMapper()
mapper.SetInputConnection(reader.GetOutputPort())
mapper.SetNumberOfThreads(int(threads))
mapper.AutoAdjustSampleDistancesOff()
mapper.SetSampleDistance(0.5)
mapper.SetInteractiveSampleDistance(0.5)
mapper.SetImageSampleDistance(1)
mapper.IntermixIntersectingGeometryOff()

volume = vtk.vtkVolume()
volume.SetMapper(mapper)
volume.SetProperty(matter)
renderer = vtk.vtkRenderer()
renderer.AddVolume(volume)
renderer.SetBackground(0, 0, 0)
window = vtk.vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(width, height)
window.SetMultiSamples(0)
window.AddRenderer(renderer)
camera = renderer.GetActiveCamera()
camera.SetFocalPoint(point(at))
camera.SetPosition(point(eye))
camera.SetViewUp(0, 1, 0)
camera.SetViewAngle(float(fov))
renderer.ResetCameraClippingRange()
window.Render()

grab = vtk.vtkWindowToImageFilter()
grab.SetInput(window)
grab.ReadFrontBufferOff()
grab.Update()
with open(out, 'wb') as file:
    file.write(memoryview(grab.GetOutput().GetPointData().GetScalars()))
