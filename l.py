import math,sys
exec(open('/tmp/rev/k.py').read().split('best={}')[0])
W=way(.5,5.,.2); print(W)
for s in (.075,.08,.09):
  for phi in (85,90,95,100,110):
    c,si=math.cos(math.radians(phi)),math.sin(math.radians(phi)); print(s,phi,closer(s*c,s*si,W,s-1e-6),shadowed(s*c,s*si,c,si,W,s-1e-6),[round(dist(r*c,r*si,W),3) for r in(.18,.2,.23)])
